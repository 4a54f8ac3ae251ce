"""One protocol for confined work: a job runs in a process of its own, under limits, and says what it has as it has it.

messages  what a job says, and what it is told
channel   a job and its end of the line
worker    the process of a job
line      the same process, seen from outside
run       stream(job, limits): its messages; here(job, take): the same in this process
process   a process group that is watched, and killed at a limit
"""
