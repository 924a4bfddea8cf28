"""The processes of a run: started, watched and ended, in processes of their own, in one, or by launch files; their progress."""
