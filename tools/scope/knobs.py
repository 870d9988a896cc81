# SPDX-License-Identifier: MIT
"""Every knob by its table, and the changes that were made, to go back by a click."""

from functools import partial

from nicegui import run, ui

from tools.virtual.port import install_micropython

install_micropython()  # before anything of the firmware

from firmware import filters  # noqa: E402


async def told(what, *arguments):
    """Do it beside the page; what went wrong is said in words. Whether it went well."""
    try:
        await run.io_bound(what, *arguments)
    except Exception as error:
        ui.notify(f"{error}", type="negative", multi_line=True, timeout=8000)
        return False
    return True


class Knobs:
    """The table: `*` differs from its default, `~` lets the ticks pause."""

    name = "Knobs"

    def __init__(self, view):
        self._session = view.session
        self._inputs, self._stars = {}, {}
        self._quiet = False
        with ui.row().classes("items-center gap-2"):
            for text, code in (
                ("Undo", "app.undo()"), ("Save to the board", "app.save()"),
                ("Defaults", "app.defaults()"), ("Yaw is 0 here", "app.zero_yaw()"),
            ):  # fmt: skip
                ui.button(text, on_click=partial(self._do, code)).props("dense outline").mark(text)
        ui.label("* differs from its default, ~ the ticks pause for some milliseconds").classes(
            "text-xs"
        )
        with ui.scroll_area().classes("w-full").style("height: 36rem"), ui.grid(
            columns="auto 11rem auto"
        ).classes("items-center gap-x-2 gap-y-0 w-full"):
            for row in self._session.rows():
                self._row(*row)

    def _row(self, knob, value, default, restarts):
        self._stars[knob.name] = ui.label().classes("text-sm font-mono whitespace-pre")
        self._say(knob.name, default, restarts)
        change = partial(self._change, knob)
        if knob.choices:
            own = ui.select(list(knob.choices), value=value, on_change=change)
        else:
            own = ui.number(value=value, min=knob.low, max=knob.high, suffix=knob.unit)
            own.on("change", partial(self._typed, knob, own))
        own.props(f'dense outlined aria-label="{knob.name}"').classes("w-full").mark(knob.name)
        self._inputs[knob.name] = own
        allowed = "" if knob.choices else f" ({knob.low:g} to {knob.high:g} {knob.unit})"
        ui.label(knob.meaning + allowed).classes("text-xs opacity-80")

    def _say(self, name, default, restarts):
        self._stars[name].text = f"{' ' if default else '*'}{'~' if restarts else ' '} {name}"

    async def _typed(self, knob, own):
        if own.value is not None:
            value = float(own.value)
            whole = isinstance(knob.default, int)
            await self._set(knob.name, round(value) if whole else value)

    async def _change(self, knob, event):
        if not self._quiet:
            await self._set(knob.name, event.value)

    async def _set(self, name, value):
        if value != self._session.settings.get(name) and not await told(
            self._session.set, {name: value}
        ):
            self.slow(force=True)

    async def _do(self, code):
        if await told(self._session.call, code):
            ui.notify(code.removeprefix("app.").removesuffix("()").replace("_", " ") + ": done")

    def slow(self, force=False):
        """What the board says that they are."""
        self._quiet = True
        for knob, value, default, restarts in self._session.rows():
            own = self._inputs[knob.name]
            self._say(knob.name, default, restarts)
            if (force or self._shown(knob.name) != value) and own.value != value:
                own.value = value
            self._shown_values[knob.name] = value
        self._quiet = False

    def _shown(self, name):
        if not hasattr(self, "_shown_values"):
            self._shown_values = {}
        return self._shown_values.get(name)


class Changes:
    """What was changed, when; a click goes back to before it."""

    name = "Changes"

    def __init__(self, view):
        self._session = view.session
        self._known = -1
        ui.label("A click sets the values back to what they were before it.").classes("text-sm")
        self._list = ui.column().classes("w-full gap-1")

    def slow(self):
        """When there are new ones."""
        marks = self._session.history.marks
        if len(marks) == self._known:
            return
        self._known = len(marks)
        self._list.clear()
        with self._list:
            for t, changed in reversed(marks[-30:]):
                text = ", ".join(f"{name}: {was} → {now}" for name, (was, now) in changed.items())
                before = {name: was for name, (was, _) in changed.items()}
                ui.button(f"{t:.1f} s   {text}", on_click=partial(self._back, before)).props(
                    "flat dense no-caps align=left"
                ).classes("w-full")

    async def _back(self, before):
        await told(self._session.set, before)


def own(settings):
    """Names of the knobs of the filter that runs."""
    return list(filters.SETTINGS.get(settings.get("filter"), ()))
