"""The page of a study: what was asked, the answer, the evidence, and how to run it again."""
