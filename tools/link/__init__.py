# SPDX-License-Identifier: MIT
"""The PC's end of a board's stream: frames apart from text, samples out of frames, knobs beside.

    frames    one frame's bytes, and a line's bytes split into text and frames
    reader    records -> samples with their numbers and times; header; what was lost
    demux     under mpremote's SerialTransport, so that the REPL works while it streams
    board     one connection: a serial port, or a pseudo-terminal of a virtual board
    link      a thread that keeps a connection, through unplugging and resets
    history   the last minutes of samples, in memory of a fixed size
"""
