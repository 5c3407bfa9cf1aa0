"""From a mission to objects: map and places, the robots' stacks, the world that they meet."""
