"""What accuracy costs: error and time of every knob, measured together on this machine.

``knobs.measure_trade`` yields one ``setting.Setting`` after the other; errors are the same each time, seconds are this
machine's. The README of this folder says what was found and why the defaults are where they are.
"""
