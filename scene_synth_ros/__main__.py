"""``python -m scene_synth_ros`` is the command ``scene_synth``."""

from scene_synth_ros.cli.command_line import main

if __name__ == "__main__":
    main()
