"""What the contacts tell: stress, coordination, second-order work per contact."""

from rendulic.micro.contact_work import CLASSES, ContactWork, contact_work
from rendulic.micro.coordination import Coordination, coordination
from rendulic.micro.stress import love_weber_stress

__all__ = ["CLASSES", "ContactWork", "Coordination", "contact_work", "coordination", "love_weber_stress"]
