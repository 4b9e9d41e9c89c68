"""Studies of a vehicle and its controllers: functions of scenario and settings."""
