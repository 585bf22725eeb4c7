"""What whole sweeps cost with an older version and with this one."""
