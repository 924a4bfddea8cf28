"""The subcommands of ``scene_synth``, a module each: ``add_arguments(parser)`` and ``run(arguments) -> exit status``."""
