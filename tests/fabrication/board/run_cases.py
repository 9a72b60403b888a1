"""Run transmitters on the stand-in board: read a JSON file of cases, write a JSON line of edges per ID.

A case is {"file": path, "name": "__main__" or other, "ids": list or null, "us": how long}.
"""

import json
import sys

import machine
import rp2


def run(case):
    with open(case["file"]) as file:
        source = compile(file.read(), case["file"], "exec")
    rp2.stop_after_clocks = int(case["us"] * machine.CLOCK_HZ // 1000000)
    words = {"__name__": case["name"]}
    if case["ids"] is None:  # the file sends by itself
        report(case, None, lambda: exec(source, words))
        return
    exec(source, words)
    for number in case["ids"]:
        words["ID"] = number
        report(case, number, words["send"])


def report(case, number, send):
    del rp2.machines[:]
    del machine.set_by_hand[:]
    try:
        send()
    except KeyboardInterrupt:
        pass
    (blinker,) = rp2.machines
    print(
        json.dumps(
            {
                "id": number,
                "pin": blinker.pin,
                "divider_256": blinker.divider_256,
                "edges": [list(edge) for edge in blinker.edges],
                "set_by_hand": machine.set_by_hand,
                "running": blinker.running,
            }
        )
    )


with open(sys.argv[1]) as file:
    cases = json.load(file)
for each in cases:
    run(each)
