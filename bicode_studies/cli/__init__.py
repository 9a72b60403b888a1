"""What notebooks and the command line share; nothing else in the package depends on it.

notebook     the drawing style, saved figures, answers checked
parameters   the parameters of a notebook, read and checked
runner       notebooks run headless, one or all
cli          the command line, one file per command: command_run, command_doctor, ...
"""
