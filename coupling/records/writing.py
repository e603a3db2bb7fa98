"""Errors of writing as one sentence with file and remedy, and files that are replaced so that they are always
whole."""
import errno
import os
import sys
from contextlib import contextmanager
from pathlib import Path
from typing import Iterator, Optional, TextIO, Union

REMEDIES = {errno.ENOSPC: "free some space on that disk or choose another folder",
            errno.EDQUOT: "free some of your quota or choose another folder",
            errno.EFBIG: "raise the limit of the size of a file (ulimit -f) or choose another folder",
            errno.ENOENT: "its folder is gone, leave it in place until the run has ended",
            errno.ESTALE: "its folder is gone, leave it in place until the run has ended"}


class OutputError(OSError):
    """A file of the results cannot be written. Its text is the sentence; ``errno`` says why."""

    def __init__(self, sentence: str, number: Optional[int] = None) -> None:
        super().__init__(sentence)
        self.errno = number

    def __reduce__(self) -> tuple:  # to go to other ranks
        return OutputError, (str(self), self.errno)


@contextmanager
def writing(path: Union[str, Path]) -> Iterator[None]:
    """An OSError inside becomes an OutputError that names ``path`` and the remedy."""
    try:
        yield
    except OutputError:
        raise
    except OSError as error:
        remedy = REMEDIES.get(error.errno or 0, "choose another folder")
        raise OutputError(f"{path} cannot be written ({error.strerror or error}): {remedy}",
                          error.errno) from error


def replace_text(path: Path, text: str, scratch: Optional[Path] = None) -> None:
    """Write ``text`` to ``path`` in one go: a reader, or a run that is killed, finds the old file or the new
    one. It is first written to ``scratch``, on the same disk (None: ``path`` with .new behind it)."""
    scratch = scratch or path.with_name(path.name + ".new")
    with writing(path):
        try:
            scratch.write_text(text, encoding="utf-8")
            os.replace(scratch, path)
        except OSError:
            scratch.unlink(missing_ok=True)  # half a file would take the space that others need
            raise


def tell(text: str, stream: Optional[TextIO] = None) -> None:
    """Print ``text``, to standard output unless another stream is given. One that nobody reads any more, the
    other end of a pipe or a closed terminal, gets nothing from then on, and so does one for errors that takes
    none."""
    stream = stream or sys.stdout
    with writing(getattr(stream, "name", "the output")):
        try:
            print(text, file=stream, flush=True)
        except OSError as error:
            silence(stream)
            if error.errno not in (errno.EPIPE, errno.EIO) and stream is not sys.stderr:
                raise


def silence(stream: TextIO) -> None:
    """Lead a stream that takes nothing any more to nowhere: what is still in its buffer would be an error at
    the end."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, stream.fileno())
    os.close(nowhere)
