"""How Sphinx makes the site of these pages: run by ``make site``, which needs no network."""

import re
import sys
from enum import Enum
from pathlib import Path

from docutils.nodes import SkipNode, math, math_block
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment
from sphinx.errors import ExtensionError
from sphinx.util.logging import getLogger
from sphinx.writers.html5 import HTML5Translator

import screwsynth.models
import screwsynth.nlp

# Scripts beside this file; Sphinx does not add its folder.
sys.path.append(str(Path(__file__).parent))
import livepages

project = "screwsynth"
extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
exclude_patterns = ["figures"]
highlight_language = "text"

html_theme = "furo"
html_title = project
html_show_copyright = False
html_show_sphinx = False
html_copy_source = False
html_static_path = ["site.css"]
html_css_files = ["site.css"]
html_math_renderer = "mathml"

myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4
nb_execution_mode = "force"
nb_execution_timeout = 300
nb_execution_raise_on_error = True

autodoc_default_options = {"members": True, "inherited-members": "object, tuple, BaseException, Enum"}
autodoc_preserve_defaults = True
napoleon_attr_annotations = False
napoleon_use_ivar = True
python_use_unqualified_type_names = True
# Both packages have a class Actuator, and a signature names it without its package.
suppress_warnings = ["ref.python"]
maximum_signature_line_length = 100


#: Reasons for missing sliders by the case of each live page of the site; empty texts for pages with sliders.
_LIVE: dict[str, str] = {}


def add_toctrees(_app: Sphinx, page: str, source: list[str]) -> None:
    """Make the site's navigation of the headings and lists of links of the first page, and of the reference's."""
    if page in {"index", "api"}:
        for group in source[0].split("\n## ")[1:]:
            pages = re.findall(r"^- \[.*?\]\((\w[\w-]*)\.\w+\)", group, flags=re.MULTILINE)
            tree = ["```{toctree}", ":hidden:", f":caption: {group.splitlines()[0]}", "", *pages, "```"]
            source[0] += "\n".join(["", *tree, ""])


def write_live_pages(app: Sphinx) -> None:
    """Write the live pages into the site, and say which of them have no sliders."""
    if app.builder.format == "html":
        _LIVE.update(livepages.write_pages(Path(app.outdir) / "live", livepages.live_names()))
        for name, fault in _LIVE.items():
            if fault:
                # No warning: the site is complete without a compiler, and warnings end the build.
                sys.stderr.write(f"live page without sliders: {name}: {fault}\n")


def add_live_links(_app: Sphinx, _page: str, source: list[str]) -> None:
    """Put links to live pages in place of the comments that name their cases."""
    source[0] = livepages.with_links(source[0], _LIVE)


def leaves_out(_app: Sphinx, kind: str, _name: str, member: object, _skip: bool, _options: object) -> bool | None:
    """Keep members of enumerations, which have no docstring; leave out what only writers of a kind of limit call."""
    if isinstance(member, Enum):
        return False
    module = str(getattr(getattr(member, "fget", member), "__module__", ""))
    return True if kind == "class" and (isinstance(member, type) or ".case.limits." in module) else None


def plain_defaults(_app: Sphinx, *described: object) -> tuple[str, str | None] | None:
    """Write dots for the default of a field that no expression of Python shows, such as a class that makes it."""
    *_, signature, returned = described
    found = re.sub(
        r"= (<(?:class|function|factory).*?>+|\(\(array.*?\),\))(?=[,)])", "= ...", signature or "", flags=re.DOTALL
    )
    return (found, returned) if found else None


def keep_colons(_app: Sphinx, kind: str, _name: str, _member: object, _options: object, lines: list[str]) -> None:
    """Keep Napoleon from reading words before a colon as the type of a property."""
    if kind == "property":
        lines.insert(0, "\\")


def check_names(_app: Sphinx, env: BuildEnvironment) -> None:
    """Refuse a site without one of the public names."""
    described = env.domains.python_domain.objects
    names = [f"{each.__name__}.{name}" for each in (screwsynth.nlp, screwsynth.models) for name in each.__all__]
    if missing := [name for name in names if name not in described]:
        raise ExtensionError(f"public names that the pages api-*.md do not describe: {', '.join(missing)}")


def write_formula(writer: HTML5Translator, node: math | math_block) -> None:
    """Write a formula as MathML, which browsers draw without a script."""
    try:
        writer.body.append(tex2mathml(node.astext(), as_block=isinstance(node, math_block)))
    except MathError as error:
        getLogger(__name__).warning("%s", error, location=node)
    raise SkipNode


def setup(app: Sphinx) -> None:
    """Connect the functions above."""
    app.connect("builder-inited", write_live_pages)
    app.connect("source-read", add_toctrees)
    app.connect("source-read", add_live_links)
    app.connect("autodoc-skip-member", leaves_out)
    app.connect("autodoc-process-signature", plain_defaults)
    app.connect("autodoc-process-docstring", keep_colons, priority=400)
    app.connect("env-check-consistency", check_names)
    app.add_html_math_renderer("mathml", (write_formula, None), (write_formula, None))
