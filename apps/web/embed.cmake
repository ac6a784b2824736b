# SPDX-License-Identifier: Apache-2.0
# cmake -DPAGE=<folder> -DLIBRARY=<d3.min.js> -DSTYLES=<a.css;...> -DMODULES=<a.js;...> -DOUT=<file.cpp> -P embed.cmake
#
# Writes the page as one text for document.cpp, with places for title, plain text and data. A page that is opened from a
# file cannot load modules, so they become one script: `import` lines and the word `export` are removed. So every name at
# a module's top level must differ from those of all others.
cmake_minimum_required(VERSION 3.25)

file(READ "${PAGE}/page.html" page)
file(READ "${LIBRARY}" library)
file(READ "${PAGE}/d3.license" license)
set(style "")
foreach(file IN LISTS STYLES)
  file(READ "${PAGE}/${file}" text)
  string(APPEND style "${text}")
endforeach()
set(script "")
foreach(file IN LISTS MODULES)
  file(READ "${PAGE}/${file}" text)
  string(PREPEND text "\n")
  string(REGEX REPLACE "\nimport [^\n]*;" "" text "${text}")
  string(REGEX REPLACE "\nexport " "\n" text "${text}")
  if(text MATCHES "\n(import|export)")
    message(FATAL_ERROR "${file}: an import or export that is not in one line")
  endif()
  string(APPEND script "${text}")
endforeach()

string(REPLACE "@STYLE@" "${style}" page "${page}")
string(REPLACE "@LIBRARY@" "/*\n${license}*/\n${library}" page "${page}")
string(REPLACE "@SCRIPT@" "(() => {\n'use strict';\n${script}\nmain();\n})();" page "${page}")
# The compilers' limit for one string literal is 64 kB in the standard's minimum; several literals stand side by side.
set(literals "")
string(LENGTH "${page}" length)
set(at 0)
while(at LESS length)
  string(SUBSTRING "${page}" ${at} 16000 part)
  string(LENGTH "${part}" size)
  math(EXPR at "${at} + ${size}")
  string(APPEND literals "    R\"~PAGE~(${part})~PAGE~\"\n")
endwhile()
file(WRITE "${OUT}" "#include <string_view>\n\nnamespace twocone::web {\n\nextern const std::string_view kPage;\nconst std::string_view kPage =\n${literals}    ;\n\n}  // namespace twocone::web\n")
