"""Time of the check of all shipped cases, one after the other.

    python -P bench/checks.py

On a quiet machine with two cores all of them take less than half a minute.
"""

from screwsynth.nlp import check

checks = check()
for each in checks:
    print(f"{each.seconds:6.2f} s  {each.name}")
print(f"{sum(each.seconds for each in checks):6.2f} s  all")
