# SPDX-License-Identifier: MIT
"""What is changed in the emulator's sources (rp2040py 0.3.6), so that it is quicker.

No change is to alter what an instruction does, how many cycles it takes or when an alarm rings.
What costs is asked less often: Python's attributes and calls for each instruction, functions that
the compiler cannot see into.
"""

_NATIVE = "rp2040py/native/"
_CORE = _NATIVE + "_cortex_m0_core.pyx"
_BUS = _NATIVE + "_rp2040.pyx"
_LOOP = _NATIVE + "_simulator.pyx"
_SIMULATOR = "rp2040py/simulator.py"
_SIO = "rp2040py/sio.py"

# Its own wheel uses only what every Python has (the stable ABI), where each access is a call
SETUP = ("setup.py", "USE_LIMITED_API = (", "USE_LIMITED_API = False and (")

SOURCES = (  # file in the package, what is there once, what is there then
    # Words of 32 bits are the compiler's own casts
    (
        _CORE,
        "from rp2040py.native._bit cimport s32, u32\n",
        """
cdef inline unsigned int u32(long long n) noexcept:
    return <unsigned int>n


cdef inline int s32(long long n) noexcept:
    return <int><unsigned int>n


""",
    ),
    # A conditional branch asked a Python method
    (
        _CORE,
        "    return core.check_condition(cond)\n",
        """    cdef unsigned int base = cond >> 1
    cdef bint met = True
    if base == 0:
        met = core.z
    elif base == 1:
        met = core.c
    elif base == 2:
        met = core.n
    elif base == 3:
        met = core.v
    elif base == 4:
        met = core.c and not core.z
    elif base == 5:
        met = core.n == core.v
    elif base == 6:
        met = core.n == core.v and not core.z
    elif cond == 15:
        return True
    return met != (cond & 1)
""",
    ),
    # Instructions are fetched from flash and RAM without a call
    (
        _CORE,
        "        opcode = self.rp2040.read_uint16(opcode_pc)\n",
        """        if opcode_pc - 0x10000000U < self.rp2040.flash_byte_size:
            opcode = (<unsigned short*>&self.rp2040._flash[opcode_pc - 0x10000000U])[0]
        elif opcode_pc - 0x20000000U < self.rp2040.ram_byte_size:
            opcode = (<unsigned short*>&self.rp2040._sram[opcode_pc - 0x20000000U])[0]
        else:
            opcode = self.rp2040.read_uint16(opcode_pc)
""",
    ),
    # Memory is read and written in words, not byte by byte (the PC is little-endian, too)
    (
        _BUS,
        "from rp2040py.native._bit cimport "
        "read_uint16_le, read_uint32_le, u32, write_uint16_le, write_uint32_le\n",
        """
cdef inline unsigned int u32(long long n) noexcept:
    return <unsigned int>n


cdef inline unsigned int read_uint16_le(unsigned char[:] memory, Py_ssize_t at) noexcept:
    return (<unsigned short*>&memory[at])[0]


cdef inline unsigned int read_uint32_le(unsigned char[:] memory, Py_ssize_t at) noexcept:
    return (<unsigned int*>&memory[at])[0]


cdef inline void write_uint16_le(unsigned char[:] memory, Py_ssize_t at, unsigned int n) noexcept:
    (<unsigned short*>&memory[at])[0] = <unsigned short>n


cdef inline void write_uint32_le(unsigned char[:] memory, Py_ssize_t at, unsigned int n) noexcept:
    (<unsigned int*>&memory[at])[0] = n


""",
    ),
    # Whether it is stopped stands in a byte that the loop can look at
    (
        _SIMULATOR,
        "class Simulator:\n",
        """class Simulator:
    @property
    def stopped(self):
        return bool(self.halt[0])

    @stopped.setter
    def stopped(self, value):
        self.halt[0] = value

""",
    ),
    (
        _SIMULATOR,
        "        self.rp2040.simulator = self\n",
        "        self.halt = bytearray(1)\n        self.rp2040.simulator = self\n",
    ),
    (_LOOP, "not simulator.stopped:", "not halt[0]:"),
    # Time passes without a call while no alarm is due, and so do the cycles of the PIOs
    (
        _LOOP,
        "from rp2040py.native._rp2040 cimport RP2040\n",
        "from rp2040py.native._pio cimport RPPIO\nfrom rp2040py.native._rp2040 cimport RP2040\n",
    ),
    (_LOOP, "cimport SimulationClock\n", "cimport ClockAlarm, SimulationClock\n"),
    (
        _LOOP,
        "    pios = rp2040.pio\n",
        """    cdef RPPIO pio0 = rp2040.pio[0]
    cdef RPPIO pio1 = rp2040.pio[1]
    cdef ClockAlarm alarm
    cdef unsigned char[:] halt = simulator.halt
""",
    ),
    (
        _LOOP,
        "            if tick_batch <= 1:\n                clock.tick(delta_nanos)\n",
        """            if tick_batch <= 1:
                alarm = clock._next_alarm
                if alarm is None or alarm.nanos > clock._nanos_counter + delta_nanos:
                    clock._nanos_counter += delta_nanos
                else:
                    clock.tick(delta_nanos)
""",
    ),
    (
        _LOOP,
        """        for pio in pios:
            if not pio.stopped:
                pio.advance(cycles)
""",
        """        if not pio0.stopped:
            pio0.cycle_fp += cycles << 8
            if pio0.cycle_fp >= pio0.next_due_fp:
                pio0._run_due()
        if not pio1.stopped:
            pio1.cycle_fp += cycles << 8
            if pio1.cycle_fp >= pio1.next_due_fp:
                pio1._run_due()
""",
    ),
    # The divider, of which each division of a program asks much, comes first
    (
        _SIO,
        "        if offset == GPIO_IN:\n",
        """        if offset == DIV_CSR:
            return self.div_csr
        if offset == DIV_REMAINDER:
            return self.div_remainder
        if offset == DIV_QUOTIENT:
            self.div_csr &= ~0b10
            return self.div_quotient
        if offset == GPIO_IN:
""",
    ),
    (
        _SIO,
        "        prev_gpio_value = self.gpio_value\n",
        """        if offset == DIV_UDIVIDEND or offset == DIV_SDIVIDEND:
            self.div_dividend = value
            self.update_hardware_divider(offset == DIV_SDIVIDEND)
            return
        if offset == DIV_UDIVISOR or offset == DIV_SDIVISOR:
            self.div_divisor = value
            self.update_hardware_divider(offset == DIV_SDIVISOR)
            return
        prev_gpio_value = self.gpio_value
""",
    ),
)
