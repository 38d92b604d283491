"""What the contacts tell: stress, fabric, coordination, second-order work per contact and grain, clustering."""

from rendulic.micro.clustering import BeyondAGrain, Clustering, beyond_a_grain, clustering
from rendulic.micro.contact_work import CLASSES, ContactWork, contact_work
from rendulic.micro.coordination import Coordination, coordination
from rendulic.micro.fabric import Fabric, fabric
from rendulic.micro.grain_work import grain_work
from rendulic.micro.stress import love_weber_stress

__all__ = [
    "CLASSES",
    "BeyondAGrain",
    "Clustering",
    "ContactWork",
    "Coordination",
    "Fabric",
    "beyond_a_grain",
    "clustering",
    "contact_work",
    "coordination",
    "fabric",
    "grain_work",
    "love_weber_stress",
]
