#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Makes the documentation as static HTML from README.md, docs/ and the man pages, by MkDocs (Debian: mkdocs, man-db).

    docs/site/build.py [FOLDER]      default: build/site

Links out of docs/ lead to copies of these files. A link to a file that does not exist is an error.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGES = {"README.md": "index.md", "ARCHITECTURE.md": "ARCHITECTURE.md", "CONTRIBUTING.md": "CONTRIBUTING.md", "CHANGELOG.md": "CHANGELOG.md"}
NAVIGATION = {
    "Start": ["index.md", "running.md", "watching.md", "python.md", "recordings.md"],
    "A real robot": ["building-a-robot.md", "drivers.md", "sight.md", "bands.md", "surveying.md", "comparing.md"],
    "Accuracy": ["accuracy.md", "tradeoff.md", "scaling.md", "performance.md", "numerical-stability.md"],
    "Simulation": ["scenes.md", "renderers.md"],
    "Reference": ["file-formats.md", "telemetry.md", "verdicts.md", "glossary.md", "compatibility.md", "CHANGELOG.md"],
    "Inside": ["ARCHITECTURE.md", "decisions.md", "CONTRIBUTING.md"],
}


def placed(target: Path, staged: Path) -> Path:
    """Returns where a file or folder of the source is in the site. What is no page is copied there."""
    inside = target.relative_to(ROOT)
    if str(inside) in PAGES:
        return staged / PAGES[str(inside)]
    if inside.parts[0] == "docs":
        page = staged / inside.relative_to("docs")
        if target.is_dir():
            index = page / "index.md"
            if not index.exists():
                names = sorted(p.name for p in target.glob("*.md"))
                index.write_text(f"# {inside.name}\n\n" + "".join(f"- [{name[:-3]}]({name})\n" for name in names))
            return index
        if page.exists():
            return page
    copy = staged / "source" / inside
    if target.is_dir():
        index = copy / "index.md"
        if not index.exists():
            copy.mkdir(parents=True, exist_ok=True)
            files = sorted(p for p in target.rglob("*") if p.is_file() and p.suffix in (".py", ".pov", ".inc", ".yaml", ".cpp", ".h", ".txt"))
            links = [os.path.relpath(placed(file, staged), copy) for file in files]
            index.write_text(f"# {inside}\n\n" + "".join(f"- [{file.relative_to(target)}]({link})\n" for file, link in zip(files, links)))
        return index
    copy = copy.with_name(copy.name + ".txt")  # which browsers show
    copy.parent.mkdir(parents=True, exist_ok=True)
    shutil.copy(target, copy)
    return copy


def with_links(text: str, source: Path, page: Path, staged: Path) -> str:
    """Returns a page whose links lead within the site."""

    def replaced(match):
        link, _, anchor = match[2].partition("#")
        if not link or "://" in link or link.startswith("mailto:"):
            return match[0]
        target = (source.parent / link).resolve()
        if not target.exists() or not target.is_relative_to(ROOT):
            raise SystemExit(f"{source.relative_to(ROOT)}: the link {match[2]} leads nowhere")
        moved = os.path.relpath(placed(target, staged), page.parent)
        return f"{match[1]}({moved}{'#' + anchor if anchor else ''})"

    # Not in blocks and spans of code.
    parts = re.split(r"(^```.*?^```|`[^`\n]*`)", text, flags=re.S | re.M)
    parts[::2] = [re.sub(r"(\])\(([^)\s]+)\)", replaced, part) for part in parts[::2]]
    return "".join(parts)


def main():
    out = Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "build/site").resolve()
    with tempfile.TemporaryDirectory() as work:
        staged = Path(work) / "pages"
        shutil.copytree(ROOT / "docs", staged, ignore=shutil.ignore_patterns("site", "*.sh", "man", "*.pov", "*.inc"))
        sources = {staged / page.relative_to(ROOT / "docs"): page for page in (ROOT / "docs").rglob("*.md")}
        sources |= {staged / page: ROOT / source for source, page in PAGES.items()}
        for page, source in sources.items():
            page.write_text(with_links(source.read_text(), source, page, staged))
        manual = []
        (staged / "man").mkdir()
        for source in sorted((ROOT / "docs/man").glob("*.1")):
            text = subprocess.run(["man", "--local-file", "--encoding=UTF-8", source], check=True, capture_output=True, text=True,
                                  env=os.environ | {"MANWIDTH": "88", "MAN_KEEP_FORMATTING": "", "LC_ALL": "C.UTF-8"}).stdout
            text = re.sub(".\b", "", text)
            (staged / f"man/{source.stem}.md").write_text(f"# {source.stem}\n\n```text\n{text}```\n")
            manual.append(f"man/{source.stem}.md")
        evidence = ["evidence/index.md"] + sorted(f"evidence/{p.name}" for p in (ROOT / "docs/evidence").glob("*.md"))
        navigation = NAVIGATION | {"Manual": manual, "Evidence": evidence}
        missing = {str(p.relative_to(staged)) for p in staged.rglob("*.md")} - {p for pages in navigation.values() for p in pages}
        unlisted = sorted(p for p in missing if not p.startswith("source/"))
        if unlisted:
            raise SystemExit(f"{Path(__file__).name}: no place in the navigation for {', '.join(unlisted)}")
        lines = ["site_name: twocone", f"docs_dir: {staged}", f"site_dir: {out}", "use_directory_urls: false", "theme: {name: readthedocs}",
                 "strict: true", "markdown_extensions: [tables, fenced_code, toc]", "nav:"]
        for title, pages in navigation.items():
            lines.append(f"  - {title}:")
            lines += [f"      - {page}" for page in pages]
        config = Path(work) / "mkdocs.yml"
        config.write_text("\n".join(lines) + "\n")
        if subprocess.run(["mkdocs", "build", "--quiet", "--clean", "--config-file", config], check=False).returncode != 0:
            raise SystemExit(f"{Path(__file__).name}: mkdocs failed")
    print(out / "index.html")


if __name__ == "__main__":
    main()
