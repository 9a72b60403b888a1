"""A stand-in for MicroPython's `rp2`: the PIO's assembler and one state machine, run step by step.

Runs under CPython and MicroPython. After the RP2040's data sheet, section 3: every instruction takes
one step and its delay; `out` takes from the output shift register, which is refilled from the queue
as soon as it is empty and otherwise waits; the divider of the clock has 8 fractional bits.
`put` only lets time pass while the queue is full, as on the board. When `stop_after_clocks` is
reached, the line is cut with KeyboardInterrupt, as by Ctrl-C.
"""

import machine

stop_after_clocks = 0  # of the system clock
machines = []  # every StateMachine that was made


class PIO:
    OUT_LOW, OUT_HIGH = 2, 3
    SHIFT_LEFT, SHIFT_RIGHT = 0, 1
    JOIN_NONE, JOIN_TX, JOIN_RX = 0, 1, 2


class Instruction:
    def __init__(self, name, *arguments):
        self.name, self.arguments, self.delay = name, arguments, 0

    def __getitem__(self, delay):
        if not 0 <= delay <= 31:
            raise ValueError("delay too large")
        self.delay = delay
        return self


def asm_pio(**settings):
    """Run the function once with the assembler's words as its globals."""

    def assemble(function):
        program, labels = [], {}

        def emit(name):
            def add(*arguments):
                program.append(Instruction(name, *arguments))
                return program[-1]

            return add

        def label(name):
            labels[name] = len(program)

        words = {"pins": "pins", "x": "x", "x_dec": "x_dec", "label": label}
        for name in ("out", "set", "jmp"):
            words[name] = emit(name)
        spelled = function.__globals__
        before = {name: spelled[name] for name in words if name in spelled}
        spelled.update(words)
        function()
        for name in words:
            del spelled[name]
        spelled.update(before)
        if len(program) > 32:
            raise ValueError("program too large")
        return program, labels, settings

    return assemble


class StateMachine:
    def __init__(self, number, assembled, freq, out_base):
        self.program, self.labels, settings = assembled
        # Only what the transmitter may rely on is built here.
        assert settings == {
            "out_init": PIO.OUT_LOW,
            "out_shiftdir": PIO.SHIFT_LEFT,
            "autopull": True,
            "pull_thresh": 32,
            "fifo_join": PIO.JOIN_TX,
        }
        if not isinstance(freq, int):
            raise TypeError("freq is an integer")
        self.divider_256 = machine.freq() * 256 // freq
        if not 256 <= self.divider_256 <= 65536 * 256:
            raise ValueError("freq out of range")
        self.pin = out_base.number
        self.running = 0
        self.queue = []
        self.shift, self.left = 0, 0  # output shift register and how many of its bits are left
        self.x, self.at, self.steps = 0, 0, 0
        self.first_out = None  # step of the first chip
        self.level, self.edges = 0, []  # (step, level)
        machines.append(self)

    def active(self, on):
        self.running = on

    def put(self, words):
        for word in words:
            assert 0 <= word < 1 << 32
            while len(self.queue) >= 8:  # two joined queues of 4
                self.step()
                if self.clocks() >= stop_after_clocks:
                    raise KeyboardInterrupt
            self.queue.append(word)

    def clocks(self):
        return 0 if self.first_out is None else (self.steps - self.first_out) * self.divider_256 // 256

    def step(self):
        """Run one instruction with its delay."""
        assert self.running
        instruction = self.program[self.at]
        self.at = (self.at + 1) % len(self.program)
        if instruction.name == "out":
            assert instruction.arguments == ("pins", 1)
            if not self.left:
                self.shift, self.left = self.queue.pop(0), 32
            self.left -= 1
            level = self.shift >> self.left & 1
            if self.first_out is None:
                self.first_out = self.steps
            if level != self.level:
                self.edges.append((self.steps - self.first_out, level))
                self.level = level
        elif instruction.name == "set":
            where, value = instruction.arguments
            assert where == "x"
            assert 0 <= value <= 31
            self.x = value
        else:
            condition, where = instruction.arguments
            assert condition == "x_dec"
            if self.x:
                self.at = self.labels[where]
            self.x = (self.x - 1) % (1 << 32)
        self.steps += 1 + instruction.delay
