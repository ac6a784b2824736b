# SPDX-License-Identifier: Apache-2.0
# Finds rosbag_storage, which reads bags of ROS 1 (Debian: librosbag-storage-dev), and makes the target Rosbag::storage.
# Debian's own files for CMake and pkg-config name packages that Debian does not have, so that the parts are looked for
# one by one.
set(RosbagStorage_INCLUDE_DIRS)
foreach(header rosbag/bag.h pluginlib/class_loader.hpp class_loader/class_loader.hpp rcpputils/shared_library.hpp
               rcutils/macros.h ament_index_cpp/get_resource.hpp)
  string(MAKE_C_IDENTIFIER RosbagStorage_${header} variable)
  get_filename_component(RosbagStorage_folder ${header} DIRECTORY)
  find_path(${variable} ${header} PATH_SUFFIXES ${RosbagStorage_folder})
  mark_as_advanced(${variable})
  list(APPEND RosbagStorage_INCLUDE_DIRS ${${variable}})
endforeach()
set(RosbagStorage_LIBRARIES)
foreach(library rosbag_storage roscpp_serialization cpp_common rostime)
  find_library(RosbagStorage_${library}_LIBRARY ${library})
  mark_as_advanced(RosbagStorage_${library}_LIBRARY)
  list(APPEND RosbagStorage_LIBRARIES ${RosbagStorage_${library}_LIBRARY})
endforeach()

include(FindPackageHandleStandardArgs)
set(RosbagStorage_complete ON)
if("${RosbagStorage_INCLUDE_DIRS};${RosbagStorage_LIBRARIES}" MATCHES NOTFOUND)
  set(RosbagStorage_complete OFF)
endif()
find_package_handle_standard_args(RosbagStorage REQUIRED_VARS RosbagStorage_rosbag_storage_LIBRARY RosbagStorage_complete)

if(RosbagStorage_FOUND AND NOT TARGET Rosbag::storage)
  add_library(Rosbag::storage INTERFACE IMPORTED)
  set_target_properties(Rosbag::storage PROPERTIES
    INTERFACE_INCLUDE_DIRECTORIES "${RosbagStorage_INCLUDE_DIRS}"
    INTERFACE_LINK_LIBRARIES "${RosbagStorage_LIBRARIES}")
endif()
