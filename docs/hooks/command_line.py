"""The reference of the command line, from the commands themselves."""

from __future__ import annotations

import html
import re
import subprocess
import sys

OPENING = """# Command line

Every command says the same with `--help`. `rendulic --install-completion` teaches the shell (bash, zsh, fish, PowerShell)
to complete commands and options with the Tab key; it takes effect in the next shell. Errors are one sentence on standard
error, and exit code 2.

"""


def command_line_page() -> str:
    """Usage, arguments, options and example of each command."""
    asked = [sys.executable, "-m", "typer", "rendulic.cli.main", "utils", "docs", "--name", "rendulic"]
    text = html.unescape(subprocess.run(asked, capture_output=True, text=True, check=True).stdout)
    text = re.sub(r"^Example: (.+)$", r"```bash\n\1\n```", text, flags=re.MULTILINE)
    return OPENING + text.replace("# `rendulic`\n", "", 1)
