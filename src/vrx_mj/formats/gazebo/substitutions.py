"""What `$(...)` means in a launch file of ROS 1; the environment stays closed."""

import os
import re
from collections.abc import Callable, Mapping
from pathlib import Path

from vrx_mj.config.search import MISSING
from vrx_mj.errors import UnknownNameError, VrxError, nearest
from vrx_mj.formats.gazebo.packages import NAMED_PACKAGES, NOWHERE
from vrx_mj.formats.urdf.expand import LEFT_OUT, evaluate_argument
from vrx_mj.formats.urdf.xacro_files import Files

_LONGEST = 20_000
"""Characters of a text."""
_MOST = 4_000_000
"""Characters of all texts of the launch files that one includes."""
_SUBSTITUTION = re.compile(r"\$\(([^)]*)\)")
_ONE_WORD = ("find", "arg", "anon", "env")


class Substitutions:
    """Substitutions in the launch files of one simulation; packages of VRX and ROS need not be there."""

    def __init__(self, files: Files) -> None:
        self.files = files
        self.left = _MOST

    def substitute(self, text: str, arguments: Mapping[str, str], folder: Path) -> str:
        """A text with each `$(...)` in it replaced, in a file in a folder. Raises VrxError."""
        whole = text.strip()
        if whole.startswith("$(eval ") and whole.endswith(")"):
            found = evaluate_argument(whole[len("$(eval ") : -1], arguments, self.find, folder)
        elif "$(eval" in text:
            raise VrxError("$(eval ...) must be the whole value, as in roslaunch; give it an <arg> of its own")
        else:
            if "$(" in text.rpartition(")")[2]:
                raise VrxError("'$(' is never closed")
            found = _SUBSTITUTION.sub(lambda match: self._resolve(match[1], arguments, folder), text)
        if len(found) > _LONGEST:
            raise VrxError(f"a text of more than {_LONGEST} characters is too long")
        self.left -= len(found)
        if self.left < 0:
            raise VrxError(f"the texts come to more than {_MOST / 1e6:g} MB")
        return found

    def _resolve(self, text: str, arguments: Mapping[str, str], folder: Path) -> str:
        """The value of `$(text)`."""
        command, *words = text.split() or [""]
        if command not in _COMMANDS:
            close = nearest(command, _COMMANDS)
            hint = f"did you mean '{close}'?" if close else f"known: {', '.join(_COMMANDS)}, eval"
            raise VrxError(f"no substitution named '{command}'; {hint}")
        if command in _ONE_WORD and len(words) != 1:
            raise VrxError(f"takes one name, $({command} NAME), got {len(words)}")
        return _COMMANDS[command](self, words, arguments, folder)

    def argument(self, name: str, arguments: Mapping[str, str]) -> str:
        """The value of an argument."""
        if name not in arguments:
            raise VrxError(f"{UnknownNameError('argument', name, arguments)}; declare it before in an <arg>")
        return arguments[name]

    def find(self, name: str) -> str:
        """The folder of a package."""
        found = self.files.package(name)
        if found is None and (name in NAMED_PACKAGES or os.environ.get(MISSING) == "ignore"):
            return f"{NOWHERE if name in NAMED_PACKAGES else LEFT_OUT}{name}"
        if found is None:
            words = str(UnknownNameError("package", name, self.files.known_packages()))
            raise VrxError(f"{words} (or add its folder to the package paths, or --missing ignore)")
        return str(found)


def _refuse_environment(name: str) -> str:
    raise VrxError(f"files cannot see environment variable '{name}'; declare an argument and use $(arg {name})")


def _default(words: list[str]) -> str:
    if not words:
        raise VrxError("takes a name and a default: $(optenv NAME DEFAULT)")
    return " ".join(words[1:])


_COMMANDS: Mapping[str, Callable[[Substitutions, list[str], Mapping[str, str], Path], str]] = {
    "find": lambda here, words, *_: here.find(words[0]),
    "arg": lambda here, words, arguments, _: here.argument(words[0], arguments),
    "dirname": lambda _, __, ___, folder: str(folder),
    "cwd": lambda *_: str(Path.cwd()),
    "env": lambda _, words, *__: _refuse_environment(words[0]),
    "optenv": lambda _, words, *__: _default(words),
    "anon": lambda _, words, *__: f"{words[0]}_anonymous",
}
