# SPDX-License-Identifier: MIT
"""tools.deploy beside an emulated board: the one in a thread, the other in this one."""

import threading
import time

from tools.deploy.copy import deploy
from tools.deploy.link import DeployError

WAIT_S = 300  # real seconds of silence; the board is far slower than a real one


class Done:
    """What a deploy said, its error (a text, or None), and the emulated seconds that it took."""

    def __init__(self):
        self.said, self.error, self.seconds = [], None, 0.0

    @property
    def text(self):
        return "\n".join([*self.said, self.error or ""])


def run(pico, job, until=None, timeout_s=600):
    """Run job(port, say) beside the board; `until(said)` true: the cable is pulled. A Done."""
    done = Done()

    def work(path):
        try:
            job(path, done.said.append)
        except DeployError as error:
            done.error = str(error)

    began = pico.nanos
    with pico.terminal() as port:
        thread = threading.Thread(target=work, args=(port.path,), daemon=True)
        thread.start()
        end = time.monotonic() + timeout_s
        while thread.is_alive() and time.monotonic() < end:
            port.serve_ms(2)
            if until and until(done.said):
                break
        if not thread.is_alive():
            port.serve_ms(20)  # its last words to the board
    done.seconds = (pico.nanos - began) / 1e9
    thread.join(120)
    assert not thread.is_alive(), done.text
    return done


def deployed(pico, files=None, until=None, **options):
    """tools.deploy.copy.deploy on the board."""
    return run(
        pico, lambda port, say: deploy(port, say=say, wait_s=WAIT_S, files=files, **options), until
    )
