"""Write docs/api.md from the docstrings of the public names: `python -m docs.api_page`."""

from __future__ import annotations

import ast
import inspect
import re
import textwrap
from pathlib import Path

import farhand
import farhand.testing

PAGE = Path(__file__).parent / "api.md"
_HEAD = """# API

Made from the docstrings of the public names by `python -m docs.api_page`; a test holds the page to them. Everything is
imported from `farhand`: `from farhand import TaskFrame, OnlineLearner, roll_out`; the checks at the end from `farhand.testing`. Arrays are numpy's; shapes use the letters of
[notation](notation.md): P task frames, K components, C coordinates of a point, T numbers of a tangent. A wrong argument raises
`InvalidInput`, which names the field and what was expected.

"""


def page() -> str:
    """Return the whole page as Markdown."""
    names = [(farhand, name) for name in farhand.__all__]
    names += [(farhand.testing, name) for name in farhand.testing.__all__]
    return _HEAD + "\n".join(_entry(name, getattr(module, name)) for module, name in names)


def _entry(name: str, value: object) -> str:
    if not (inspect.isclass(value) or inspect.isfunction(value)):
        return f"## {name}\n`{name} = {value!r}`\n"
    lines = [f"## {name}", f"```python\n{_signature(name, value)}\n```", _prose(inspect.getdoc(value) or "")]
    if inspect.isclass(value):
        lines += [f"- **`{title}`**: {_first(doc)}" for title, doc in _members(value)]
    return "\n".join(lines) + "\n"


def _members(kind: type) -> list[tuple[str, str]]:
    """List the public members of a class with their docstrings, in the order of the source."""
    tree = ast.parse(textwrap.dedent(inspect.getsource(kind))).body[0]
    assert isinstance(tree, ast.ClassDef)
    found = []
    for node in tree.body:
        if isinstance(node, ast.FunctionDef) and not node.name.startswith("_"):
            member = inspect.getattr_static(kind, node.name)
            is_property = isinstance(member, property)
            call = node.name if is_property else f"{node.name}({ast.unparse(_without_self(node))})"
            found.append((call, ast.get_docstring(node) or ""))
    return found


def _without_self(node: ast.FunctionDef) -> ast.arguments:
    decorators = {ast.unparse(decorator) for decorator in node.decorator_list}
    if "staticmethod" not in decorators:
        node.args.args = node.args.args[1:]
    return node.args


def _signature(name: str, value: object) -> str:
    try:
        text = str(inspect.signature(value))  # type: ignore[arg-type]
    except (TypeError, ValueError):
        text = ""
    if inspect.isclass(value) and getattr(value, "_is_protocol", False):
        return f"class {name}(Protocol)"
    text = text.replace("= ''", '= ""').replace("'", "")  # annotations are kept as strings
    return f"{'class ' if inspect.isclass(value) else ''}{name}{text}"


def _first(doc: str) -> str:
    """Return the first paragraph of a docstring on one line."""
    return " ".join(doc.split("\n\n")[0].split())


def _prose(doc: str) -> str:
    """Turn a docstring into Markdown: each argument, result and error becomes a list item."""
    out: list[str] = []
    for paragraph in doc.split("\n\n"):
        head, _, body = paragraph.partition("\n")
        if re.fullmatch(r"(Args|Raises|Returns|Attributes):", head.strip()):
            items = re.split(r"\n(?=\S)", textwrap.dedent(body))
            out.append(f"*{head.strip()[:-1]}*\n" + "\n".join("- " + _item(item) for item in items))
        else:
            out.append(textwrap.dedent(paragraph))
    return "\n\n".join(out) + "\n"


def _item(text: str) -> str:
    name, colon, rest = " ".join(text.split()).partition(": ")
    return f"`{name}`: {rest}" if colon and " " not in name else " ".join(text.split())


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
