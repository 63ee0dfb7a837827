"""``wentry doctor``."""

from __future__ import annotations

import click

from wentry_cli.cli import options as opt


@click.command(name="doctor")
@opt.as_json
def command(as_json: bool) -> None:
    """Show versions, what video can be read, and whether two builds of OpenCV stand in each other's way."""
    from wentry_cli.cli.console import show_json
    from wentry_cli.errors import WentryError
    from wentry_cli.runner.doctor import examine

    facts, problems = examine()
    if as_json:
        show_json({"facts": facts, "problems": problems})
    else:
        for name, value in facts.items():
            click.echo(f"{name + ':':28} {value}")
        click.echo("no problem found" if not problems else "")
    if problems:
        raise WentryError("\n".join(problems))
