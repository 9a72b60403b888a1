"""Write the API reference and the options of the command line while mkdocs builds the documentation.

The reference has one page for each package. A package that lists public names in its ``__all__`` shows these names.
Any other package, such as a chapter of the studies, shows the public names of each of its modules.
"""

from __future__ import annotations

import importlib
import pkgutil
import re
from collections.abc import Iterator
from types import ModuleType

import click
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

from bicode_studies.cli.main import cli

PACKAGES = ("bicode_lab", "bicode_studies")
MODULE_ALONE = "::: {}\n    options:\n      members: []\n      show_root_heading: false\n"
HELP = re.compile(r"<!-- help: ([\w-]+) -->")
OUTSIDE = re.compile(r'((?:href|src)=")((?:\.\./)+)')


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Add the pages of the reference to the navigation."""
    assert config.nav is not None
    config.nav.append({"Reference": [{package.__name__: page_of(package)} for package in packages()]})
    return config


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages of the reference to the files."""
    for package in packages():
        files.append(File.generated(config, page_of(package), content=reference(package)))
    return files


def on_page_markdown(markdown: str, **_: object) -> str:
    """Replace ``<!-- help: COMMAND -->`` by the help of that command."""
    return HELP.sub(lambda found: f"```\n{help_of(found[1])}\n```", markdown)


def on_page_content(html: str, page: Page, **_: object) -> str:
    """Lead links to files outside ``docs/`` from ``build/docs/`` to the repository."""
    depth = page.file.src_uri.count("/")
    return OUTSIDE.sub(lambda link: link[1] + link[2] + "../" * (link[2].count("../") > depth), html)


def packages() -> Iterator[ModuleType]:
    """Import both packages and all packages inside them, in the order of their names."""
    for name in PACKAGES:
        package = importlib.import_module(name)
        yield package
        for found in pkgutil.iter_modules(package.__path__, f"{name}."):
            if found.ispkg:
                yield importlib.import_module(found.name)


def help_of(name: str) -> str:
    """Return what ``bicode COMMAND --help`` prints."""
    context = click.Context(cli, info_name="bicode", terminal_width=100)
    command = cli.get_command(context, name)
    assert command is not None, name
    return command.get_help(click.Context(command, info_name=name, parent=context, terminal_width=100))


def page_of(package: ModuleType) -> str:
    """Return the path of a package's page."""
    return f"reference/{package.__name__}.md"


def reference(package: ModuleType) -> str:
    """Return the page of a package: what it is for, and its public names."""
    name = package.__name__
    parts = [f"# {name}\n", MODULE_ALONE.format(name)]
    if name in PACKAGES:
        parts += [f"- [{each}][{home(package, each)}]" for each in getattr(package, "__all__", ())]
        parts.append("")
    elif hasattr(package, "__all__"):
        return "\n".join([*parts, *(f"::: {name}.{each}\n" for each in package.__all__)])
    modules = [found.name for found in pkgutil.iter_modules(package.__path__, f"{name}.") if not found.ispkg]
    return "\n".join([*parts, *(f"::: {each}\n" for each in modules if not each.rpartition(".")[2].startswith("_"))])


def home(package: ModuleType, name: str) -> str:
    """Return the full name under which the reference shows a name that a package passes on."""
    value = getattr(package, name)
    return f"{value.__module__}.{value.__qualname__}" if hasattr(value, "__qualname__") else value.__name__
