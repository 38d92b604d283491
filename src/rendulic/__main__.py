"""`python -m rendulic` is the command `rendulic`."""

from rendulic.cli.main import run

if __name__ == "__main__":
    run()
