"""Commands that are not studies: list, status, report, export, compare, baseline; and the group of all commands."""
