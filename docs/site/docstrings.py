"""What griffe, which reads the code for the pages of the API, must know of this project's docstrings."""
import re

import griffe

EXAMPLE = re.compile(r"^>>> .*(?:\n(?!\s*$).*)*", re.M)
FIELD = re.compile(r"^    (\w+)\s*:[^\n#]*#\s*(.*)$", re.M)  # as in coupling/keys.py


class Docstrings(griffe.Extension):
    """Docstrings as Markdown: examples become blocks of code, comments behind the fields of a dataclass a
    table."""

    def on_object(self, *, obj, **_):
        """Called for each module, class, function and attribute, when all of them are read."""
        if obj.docstring:
            obj.docstring.value = EXAMPLE.sub(lambda found: f"```pycon\n{found.group()}\n```",
                                              obj.docstring.value)

    def on_class(self, *, cls, **_):
        """Called for each class."""
        rows = [f"| `{name}` | {comment.replace('|', chr(92) + '|').replace('<', '&lt;')} |"
                for name, comment in FIELD.findall(cls.source) if name in cls.attributes]
        if rows and cls.docstring:
            cls.docstring.value += "\n\n" + "\n".join(["| field | meaning |", "| --- | --- |", *rows])
