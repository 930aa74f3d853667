"""The motions that gears can meet along the speed, in operation, after a change of the load or a knock,
and what their teeth bear of them.
"""
