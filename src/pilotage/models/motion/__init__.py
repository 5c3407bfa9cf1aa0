"""How robots move: the data sheets of the registered motions. What they truly do is simulated in ``sim``."""
