# SPDX-License-Identifier: MIT
"""Which mpy-cross compiles which viper or native function right, executed on the PC.

Each function of lib/ and firmware/ is compiled as it goes to a board, its machine code is decoded
by pypcode and run by a small interpreter with MicroPython's function table behind it, and what it
leaves behind is compared bit for bit with the checked viper's on the same inputs.

    compilers   mpy-cross by version             mpy         what is in a .mpy file
    functions   viper and native code by name    virtual     all that comes from tools.virtual
    recorder    calls with all they reach        snapshot, tape   what such a call reaches
    scenarios, workouts, at_random   programs that make those calls
    snippets    functions made to show faults    processors  registers and conventions
    pcode       p-code to Python, block by block    memory   pages and what is in them
    machine     the run of a function            runtime, objects   mp_fun_table
    verdict     equal or not, and where          report      the tables

What it says is of mpy-cross, which makes the .mpy files of a release. The compiler on a board is
the same source, but keeps a third local in a register: a fault of mpy-cross may not show there.
"""
