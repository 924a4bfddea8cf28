"""What ``test_docs_commands.py`` does with each command line of README, CONTRIBUTING and docs: one row each."""

from __future__ import annotations

from typing import NamedTuple


class Run(NamedTuple):
    """Runs in a shell, in a folder with the files of ``docs_folder``; ends with status 0.

    Attributes:
        line: what runs in place of the printed line, smaller or with other names; empty: the line itself.
        makes: files that are there afterwards.
    """

    line: str = ""
    makes: tuple[str, ...] = ()


class Parsed(NamedTuple):
    """Is taken by the command's own parser; the files, parameters and values that a run names exist, as does a target of make.

    Attributes:
        by: the test that runs what the line does, ``file`` or ``file::test``; or why none does.
    """

    by: str


class Usage(NamedTuple):
    """Is a form with placeholders: parsed with all options given, numbers for N, S, R, HZ and PX.

    Attributes:
        by: as of ``Parsed``.
    """

    by: str


class Named(NamedTuple):
    """Is part of a command line: the command and the options exist."""


class Listed(NamedTuple):
    """Is not run here."""

    why: str


_ROS2CLI = Listed("needs ros2cli, which is not among the wheels")
_MAIN_JOB = "test/scene_synth_ros/test_main_job.py::test_the_run_reports_no_fault_and_draws_the_sheet"
_ALIKE = "test/scene_synth_ros/test_several_renderers.py::test_shared_rooms_one_process_and_rooms_ahead_give_the_same_bag"
_REPLAY = "test/scene_synth_ros/replay/test_player.py::test_loop_begins_again_until_it_is_switched_off"
_WALL = "test/scene_synth_ros/test_wall_clock.py"
_SPLIT = "test/scene_synth_ros/splits/test_split_command.py::test"
_SWEEP = "test/scene_synth_ros/sweep/test_sweep.py::test"
_CLI = "test/scene_synth_ros/cli"
_GALLERY = f"{_CLI}/pictures/test_gallery.py draws single models"
_CATALOG = f"{_CLI}/commands/test_catalog_command.py::test_the_check_names_each_fault"
_SAMPLE = f"{_CLI}/commands/test_sample_command.py::test_writes_every_kind_of_file_and_a_record_of_the_chain"
_ROBOTS = f"{_CLI}/parameters/test_run_profile.py::test_a_namespace_of_its_own_stands_before_the_frames_unless_the_profile_says_otherwise"
_GENERATE_TESTS = "test/scene_synth_ros/cli/commands/test_generate_command.py"
_GENERATE = f"{_GENERATE_TESTS}::test_a_run_that_was_killed_goes_on_with_more_workers_to_the_same_bytes"
_EVALUATE_TESTS = "test/scene_synth_ros/evaluate/test_evaluate_command.py"
_EVALUATE = f"{_EVALUATE_TESTS}::test_the_truth_as_estimate_is_perfect"
_CONVERT = "test/scene_synth_ros/cli/commands/test_convert_command.py::test_the_folder_appears_whole_and_the_line_says_what_is_in_it"
_FAST = "-p grammar_node.rate_hz:=30.0 -p renderer_node.camera.width:=320 -p renderer_node.camera.height:=240"
_TINY = "-p renderer_node.camera.width:=96 -p renderer_node.camera.height:=72 -p renderer_node.render.samples_per_pixel:=1"

RECORD = "scene_synth run --record BAG --rooms 4 --show page.html"
"""Makes the bag of the other rows; runs once."""

_ESTIMATE = "test/scene_synth_ros/estimate/test_estimate_command.py::test_bytes_are_those_of_the_dataset_where_all_rooms_are_measured"
_RAY = "test/scene_synth_ros/cluster/test_ray_shards.py::test_a_node_that_is_killed_at_work_changes_nothing_of_the_dataset"
_OWN_RAY = "test/scene_synth_ros/cluster/test_ray_shards.py::test_a_ray_of_the_runs_own_begins_and_ends_with_it"
_SHARES = "test/scene_synth_ros/cli/commands/test_generate_shares.py::test_the_last_share_writes_the_manifest_that_a_single_run_writes"

ROWS: dict[str, Run | Parsed | Usage | Named | Listed] = {
    # make
    "make run": Parsed(_MAIN_JOB),
    "make run ROOMS=10 FRAMES=30 SEED=7": Parsed(_MAIN_JOB),
    "make setup": Parsed("runs before every test"),
    "make test": Parsed("is what runs this test"),
    "make lint": Parsed("a check of its own, which finds no fault of a run"),
    "make docs": Parsed("test/test_docs.py::test_the_map_of_the_architecture_is_up_to_date"),
    "make gallery": Parsed(f"takes many minutes; {_GALLERY}"),
    "make bench": Parsed("takes many minutes, and speed is never judged in a test"),
    "make test-slow": Parsed("is what .ci/run runs beside make test"),
    "make soak": Parsed("takes hours"),
    "make soak SOAK_FRAMES=2000": Parsed("takes hours"),
    "make soak SOAK_ROOMS=2000 SOAK_KILLS=50 SOAK_MINUTES=300": Parsed("takes hours"),
    ".venv/bin/python test/helpers/golden_rooms.py --renew": Listed("writes the golden hashes of the sources anew"),
    ".venv/bin/python test/fuzz/campaign.py --cases 20000": Listed("takes minutes; test/fuzz runs campaigns"),
    # installing
    "apt install gcc g++ python3-dev chromium": Listed("needs root and the network"),
    ".venv/bin/pip install '.[denoise]'": Listed("needs the network; that the extra exists is tested"),
    ".venv/bin/pip install '.[bench-reference]'": Listed("needs the network; that the extra exists is tested"),
    "export DRJIT_LIBLLVM_PATH=/usr/lib/x86_64-linux-gnu/libLLVM.so.19.1": Listed("names the library of another package, for Mitsuba"),
    # system ROS 2
    "mkdir -p ~/ws/src && cd ~/ws && git clone <this repository> src/scene_synth_ros": Listed("makes a folder of the user's home"),
    "rosdep install --from-paths src --ignore-src -y": Listed("needs rosdep, root and the network"),
    "python3 -m venv --system-site-packages .venv && touch .venv/COLCON_IGNORE && source .venv/bin/activate": Run(
        "python3 -m venv --without-pip --system-site-packages new && touch new/COLCON_IGNORE && source new/bin/activate",
        ("new/bin/python",),
    ),
    'pip install -r src/scene_synth_ros/requirements.txt "pyoidn>=2.5"': Listed("needs the network; setup.py reads the same file"),
    "colcon build && source install/setup.bash": Listed("test/packaging/test_colcon.py builds with colcon and runs what it installed"),
    "source ~/ws/.venv/bin/activate": Listed("a workspace in the user's home"),
    "source ~/ws/install/setup.bash": Listed("a workspace in the user's home"),
    "apt install libembree-dev": Listed("needs root and the network"),
    "docker build -t scene_synth_ros . && mkdir -p runs && "
    'docker run --rm --user "$(id -u)" --shm-size 1g -v "$PWD/runs:/runs" scene_synth_ros': Listed("needs Docker"),
    "ros2 launch scene_synth_ros synth.launch.py rviz:=true": _ROS2CLI,
    "ros2 launch scene_synth_ros synth.launch.py params_file:=main record:=true bag_path:=my_bag": _ROS2CLI,
    "ros2 launch scene_synth_ros machine.launch.py machines:=2 index:=0": _ROS2CLI,
    "ros2 run scene_synth_ros scene_synth": _ROS2CLI,
    "ros2 run scene_synth_ros scene_synth --help": _ROS2CLI,
    "ros2 launch scene_synth_ros synth.launch.py clock:=wall rviz:=true": _ROS2CLI,
    "ros2 bag": _ROS2CLI,
    "ros2 bag info my_bag && ros2 bag play my_bag --clock-topics-all": _ROS2CLI,
    "ros2 param describe": _ROS2CLI,
    "ros2 param dump": _ROS2CLI,
    "ros2 lifecycle set": _ROS2CLI,
    "rviz2 -d config/views/synth.rviz": Listed("needs RViz; that the file exists is tested"),
    "ros2 security create_keystore keys": _ROS2CLI,
    "ros2 security create_enclave keys /synth/grammar_node": _ROS2CLI,
    "ros2 security create_permission keys /synth/grammar_node"
    " $(ros2 pkg prefix --share scene_synth_ros)/config/security/policy.xml": _ROS2CLI,
    "export ROS_SECURITY_KEYSTORE=$PWD/keys ROS_SECURITY_ENABLE=true ROS_SECURITY_STRATEGY=Enforce": Listed(
        "the wheels' Fast DDS has no security plugins"
    ),
    "ros2 run scene_synth_ros grammar_node --ros-args -r __ns:=/synth --enclave /synth/grammar_node": _ROS2CLI,
    # scene_synth run, demo
    "scene_synth run": Named(),
    "scene_synth run --record": Named(),
    "scene_synth run --overlay lidar_robot --overlay realtime -p renderer_node.camera.width:=320 -p renderer_node.camera.height:=240"
    " -p renderer_node.realtime:=true --rooms 1 --frames 450 --record BAG": Parsed("test/scene_synth_ros/test_live_body.py"),
    "scene_synth run --overlay lidar_robot --overlay realtime -p renderer_node.camera.width:=64 -p renderer_node.camera.height:=48"
    " -p renderer_node.streams.normals:=false -p renderer_node.streams.semantic:=false -p renderer_node.streams.instance:=false"
    " --rooms 1 --frames 9000 --record ten": Parsed("test/scene_synth_ros/test_live_body.py"),
    RECORD: Run(f"scene_synth run --record BAG --rooms 1 --frames 2 --show page.html {_TINY}", ("BAG/metadata.yaml", "page.html")),
    "scene_synth run --record BAG -p renderer_node.streams.semantic_classes:=coco": Parsed(
        "test/scene_synth_ros/verify/test_verify.py"
        "::test_a_bag_with_the_classes_of_another_standard_is_the_same_again_and_drawn_in_its_colours"
    ),
    "scene_synth demo": Parsed("test/scene_synth_ros/cli/commands/test_show_command.py::test_the_demo_is_a_run_in_one_folder"),
    ".venv/bin/scene_synth demo": Parsed("test/scene_synth_ros/cli/commands/test_show_command.py::test_the_demo_is_a_run_in_one_folder"),
    "scene_synth run --record bag --rooms 20 --frames 30": Parsed(_MAIN_JOB),
    "scene_synth run --record bag --renderers 2": Parsed(_ALIKE),
    "scene_synth run --record bag --rooms 2 --frames 4 -p renderer_node.streams.annotations:=true": Parsed(
        "test/scene_synth_ros/verify/test_verify.py::test_every_frame_tells_of_the_objects_in_its_instance_image"
    ),
    "scene_synth run --record bag --params split_outputs": Parsed(
        "test/scene_synth_ros/test_several_renderers.py::test_colour_and_truth_of_two_renderers_have_the_same_stamps"
    ),
    "scene_synth run --record bag --respawn 5": Parsed(
        "test/scene_synth_ros/test_several_renderers.py::test_a_renderer_that_is_killed_is_started_again_and_its_room_is_whole"
    ),
    "scene_synth run --record bag --one-process": Parsed(_ALIKE),
    "scene_synth run --params live -p grammar_node.clock:=wall": Parsed(_WALL),
    f"scene_synth run --params live {_FAST}": Parsed(
        "needs a machine to itself to hold its rate; test/scene_synth_ros/render/test_live_rooms.py has the same at 48x36"
    ),
    "scene_synth run --params live --namespace /robot1 -p grammar_node.clock:=wall -p grammar_node.seed:=1": Parsed(_ROBOTS),
    "scene_synth run --params live --namespace /robot2 -p grammar_node.clock:=wall -p grammar_node.seed:=2": Parsed(_ROBOTS),
    "scene_synth run --params parameters.yaml": Usage(
        "test/scene_synth_ros/verify/test_verify.py::test_the_bag_says_what_made_it_and_its_parameters_make_it_again"
    ),
    "scene_synth run --grammar waiting_room.yaml": Parsed(
        "test/scene_synth_ros/cli/parameters/test_run_profile.py::test_a_grammar_file_comes_with_its_room_type_and_is_checked_first"
    ),
    "scene_synth run -p grammar_node.scene.grammar_set:=by_hand": Parsed("test/grammar/test_grammar_set.py"),
    "scene_synth run -p \"grammar_node.scene.looks:=['bed/duvet: {material: deep_cover, base_color: [0.1, 0.2, 0.3]}',"
    " 'nightstand: {styles: [drawers]}']\"": Parsed("test/grammar/appearance/test_looks.py"),
    "scene_synth run --overlay rplidar_a1 -p renderer_node.streams.points:=true --rooms 2 --frames 20 --record my_bag": Parsed(
        "test/scene_synth_ros/test_scan_bag.py"
    ),
    "scene_synth run --overlay turtlebot --rooms 1 --frames 300 --record my_bag": Parsed("test/scene_synth_ros/test_body_bag.py"),
    "scene_synth run --overlay handheld --overlay d435i --rooms 1 --frames 300 --record my_bag": Parsed(
        "test/scene_synth_ros/test_body_bag.py"
    ),
    "scene_synth generate --rooms 2 --frames 300 --overlay euroc_stereo --out bags": Parsed("test/scene_synth_ros/test_body_bag.py"),
    "scene_synth run --overlay lidar_robot --rooms 1 --frames 300 --record my_bag": Parsed("test/scene_synth_ros/test_lidar_bag.py"),
    "scene_synth generate --rooms 2 --frames 300 --overlay turtlebot --overlay os1_64 --out bags": Parsed(
        "test/scene_synth_ros/test_lidar_bag.py"
    ),
    "scene_synth run --overlay lidar_robot --overlay realtime -p renderer_node.drive.enabled:=true -p renderer_node.realtime:=true"
    " --rooms 1 --frames 900 --record driven": Parsed("test/scene_synth_ros/test_driven_base.py"),
    "scene_synth run -p grammar_node.lock_step:=true -p grammar_node.start_stopped:=true": Parsed(
        "test/scene_synth_ros/simulation/test_simulation_services.py"
    ),
    "sudo apt install ros-jazzy-simulation-interfaces": Listed("needs a system ROS 2"),
    "scene_synth generate --rooms 1 --frames 600 --overlay realsense_d435i --overlay realtime --out vio": Parsed(
        "test/scene_synth_ros/test_body_bag.py"
    ),
    "scene_synth generate --rooms 1 --frames 600 --overlay euroc_stereo --overlay realtime --out drone": Parsed(
        "test/scene_synth_ros/test_body_bag.py"
    ),
    "scene_synth convert drone --to euroc --out drone_euroc": Parsed(_CONVERT),
    "scene_synth generate --rooms 1 --frames 450 --overlay lidar_robot --overlay realtime --out lidar": Parsed(
        "test/scene_synth_ros/test_lidar_bag.py"
    ),
    "python -m benchmarks.judges.lidar_odometry --rooms 2": Parsed("needs KISS-ICP, RKO-LIO and small_gicp, which are not installed"),
    "python -m benchmarks.judges.lidar_odometry --rooms 4 --frames 200 -p grammar_node.motion.kind:=handheld"
    " -p renderer_node.wheels.enabled:=false": Parsed("needs KISS-ICP, RKO-LIO and small_gicp, which are not installed"),
    "python -m benchmarks.judges.lidar_odometry --rooms 4 --frames 200 -p grammar_node.motion.speed_m_s:=1.0"
    " -p grammar_node.motion.turn_rad_s:=3.0 -p grammar_node.motion.acceleration_m_s2:=2.0 -p grammar_node.motion.jerk_m_s3:=20.0"
    " -p grammar_node.motion.turn_acceleration_rad_s2:=8.0": Parsed("needs KISS-ICP, RKO-LIO and small_gicp, which are not installed"),
    "scene_synth run --overlay turtlebot --overlay realtime -p renderer_node.drive.enabled:=true -p renderer_node.realtime:=true": Parsed(
        "test/scene_synth_ros/test_driven_base.py"
    ),
    "ros2 run teleop_twist_keyboard teleop_twist_keyboard --ros-args -r cmd_vel:=/synth/cmd_vel": _ROS2CLI,
    "scene_synth generate --rooms 1 --frames 600 --overlay turtlebot --overlay realtime --out laser": Parsed(
        "test/scene_synth_ros/test_body_bag.py"
    ),
    "pytest examples/slam_gate": Listed("test/scene_synth_ros/testing/test_judge.py::test_the_plugin_runs_a_test_file_and_keeps_its_bags"),
    "scene_synth prove BAG": Run(),
    "scene_synth export": Named(),
    "python -m benchmarks.judges.visual_slam --rooms 2 --size 480x360": Parsed("needs pyorbslam3, which is not installed"),
    "python -m benchmarks.judges.lidar_odometry --write": Parsed("needs KISS-ICP, which is not installed"),
    "scene_synth prove my_bag": Parsed("test/scene_synth_ros/prove/test_prove.py"),
    "scene_synth prove my_bag --json": Parsed("test/scene_synth_ros/prove/test_prove.py"),
    "scene_synth sample --room living_room --seed 3 --frames 20 --out rooms": Run(
        "scene_synth sample --room living_room --seed 3 --frames 20 --out scanned", ("scanned/room_0000.json",)
    ),
    "scene_synth render rooms/room_0000.json --out pictures --overlay rplidar_a1": Run(
        "scene_synth render room.json --out scan_pictures --overlay rplidar_a1 --size 16x12 --spp 1 --frames 1",
        ("scan_pictures/scans.npz", "scan_pictures/scan.png"),
    ),
    "scene_synth run --overlay kinect_v1 --rooms 2 --frames 8 --record my_bag": Parsed(
        "test/scene_synth_ros/cli/parameters/test_camera_presets.py::test_a_preset_is_a_camera_and_nothing_else"
    ),
    "scene_synth run --params main -p grammar_node.scene.daylight:=overcast --rooms 2 --frames 8 --record my_bag": Parsed(
        "test/grammar/appearance/test_lighting.py"
    ),
    "scene_synth run --params demo --frames 1 --record runs/docs --contact-sheet docs/contact_sheet.jpg": Parsed(_MAIN_JOB),
    "scene_synth run --record runs/kitchen --rooms 1 --frames 8 --seed 9 --overlay balanced"
    " -p grammar_node.scene.room_type:=kitchen --show kitchen.html": Parsed(_MAIN_JOB),
    "chromium --headless=new --hide-scrollbars --window-size=1400,900 --virtual-time-budget=10000 --screenshot=docs/show.jpg"
    ' "file://$PWD/kitchen.html#frame=5&x=390&y=290"': Listed(
        "needs Chromium; test/scene_synth_ros/cli/page/test_show_page_in_browser.py drives one where it is installed"
    ),
    # bags
    "scene_synth inspect": Named(),
    "scene_synth inspect BAG": Run(),
    "scene_synth show BAG": Run(makes=("BAG.html",)),
    "scene_synth show BAG --out page.html --rooms 20 --frames 30 --max-size 320 --open": Run(makes=("page.html",)),
    "scene_synth report evaluation.json": Run(makes=("report.html",)),
    "scene_synth report before.json after.json --out report.html --open": Run(makes=("report.html",)),
    "scene_synth report evaluation.json --bag-root bags --estimates estimates --worst 12 --max-size 640": Parsed(
        "test/scene_synth_ros/report/test_report_file.py::test_estimates_are_found_in_the_bag_itself_or_where_they_are_said_to_be"
    ),
    "scene_synth sweep docs/report_sweep.yaml --out runs/depth_cameras": Listed("takes minutes"),
    'scene_synth evaluate runs/depth_cameras --task depth --title "Depth cameras" --json runs/depth_cameras/evaluation.json': Listed(
        "judges what the row above makes"
    ),
    "scene_synth report runs/depth_cameras/evaluation.json --out report.html": Parsed("the rows above"),
    "chromium --headless=new --hide-scrollbars --window-size=1400,2250 --virtual-time-budget=10000 --screenshot=docs/report.jpg"
    ' "file://$PWD/report.html"': Listed("needs chromium; makes the picture of the page"),
    "scene_synth verify": Named(),
    "scene_synth verify BAG": Run(),
    "scene_synth repair BAG": Run(makes=("BAG_repaired/metadata.yaml",)),
    "scene_synth replay BAG --loop": Parsed(_REPLAY),
    "scene_synth replay BAG --clock 100 --paused": Parsed(
        "test/scene_synth_ros/replay/test_replay_node.py::test_services_parameters_and_signals"
    ),
    "scene_synth replay BAG --rate 2 --loop --start-offset 5 --topics /synth/camera/color/image_raw"
    " --remap /synth/camera/color/image_raw:=/camera/image": Run(
        "scene_synth replay BAG --rate 2 --topics /synth/camera/color/image_raw --remap /synth/camera/color/image_raw:=/camera/image"
    ),
    # rooms
    "scene_synth generate": Named(),
    "scene_synth generate --rooms 1000 --frames 8 --seed 1 --params ground_truth --out runs/rooms": Parsed(_GENERATE),
    "scene_synth generate --rooms 5000 --seed 1 --overlay balanced --shard-size 1GB --out runs/pictures": Parsed(_GENERATE),
    "scene_synth generate --rooms 200 --seed 3 --out runs/kitchens --params ground_truth"
    " -p grammar_node.scene.room_type:=kitchen,dining_room": Parsed(_GENERATE),
    "scene_synth generate --resume --out runs/rooms": Parsed(_GENERATE),
    "scene_synth generate --rooms 5000 --resume --out runs/rooms": Parsed(
        "test/scene_synth_ros/cli/commands/test_generate_mixed.py::test_more_rooms_extend_a_dataset_whose_shards_and_splits_stay"
    ),
    "scene_synth generate --resume --check --out runs/rooms": Parsed(f"{_GENERATE_TESTS}::test_a_damaged_shard_is_found_and_made_again"),
    "scene_synth generate --plan runs/rooms/dataset.json --out runs/again": Parsed(
        f"{_GENERATE_TESTS}::test_a_plan_makes_its_dataset_again_elsewhere_but_not_in_another_version"
    ),
    ".venv/bin/python -m benchmarks.generate_bench --write": Parsed("takes half an hour; speed is never judged in a test"),
    "ros2 bag play": _ROS2CLI,
    "scene_synth split rooms": Parsed(f"{_SPLIT}_every_room_is_in_one_split_and_datasets_read_it"),
    "scene_synth split rooms --shares fit=2/3,check=1/3 --seed 7": Parsed(f"{_SPLIT}_every_room_is_in_one_split_and_datasets_read_it"),
    "scene_synth generate --rooms 40 --frames 4 --seed 11 --overlay realtime -p renderer_node.camera.width:=160"
    " -p renderer_node.camera.height:=120 --out rooms": Parsed(_GENERATE),
    "scene_synth split rooms --shares train=0.8,val=0.2 --balance": Parsed(f"{_SPLIT}_a_balance_is_written_beside_the_same_rooms"),
    ".venv/bin/python examples/segment_pixels.py rooms": Listed("needs a dataset; test/test_segment_pixels.py makes one and runs it"),
    "scene_synth split rooms --balance": Parsed(f"{_SPLIT}_a_balance_is_written_beside_the_same_rooms"),
    "scene_synth split rooms --balance 0.3": Parsed(f"{_SPLIT}_a_balance_is_written_beside_the_same_rooms"),
    "scene_synth split rooms --ranges train=0:8000,val=8000:9000": Parsed(f"{_SPLIT}_filters_and_what_they_leave_out"),
    "scene_synth split rooms --sees bed,sofa --image-share 0.02 --objects 3: --brightness 0.15:0.85 --near 0.1:5": Parsed(
        f"{_SPLIT}_filters_and_what_they_leave_out"
    ),
    "scene_synth convert rooms --split train --to coco --out train_coco": Parsed(
        "test/scene_synth_ros/convert/formats/test_coco.py::test_masks_boxes_and_classes_are_those_of_the_pixels"
    ),
    "scene_synth sweep illumination --only 0017 0021 0022 0025 0026 0029 0031 0033"
    " --out runs/illumination --contact-sheet docs/sweeps.jpg": (
        Parsed("takes a minute; test/scene_synth_ros/sweep/test_sweep.py draws a smaller one")
    ),
    "scene_synth sweep objects --plan": Run(),
    "scene_synth sweep objects --out runs/objects --workers 2": Parsed(f"{_SWEEP}_workers_change_no_byte"),
    "scene_synth sample": Named(),
    "scene_synth sample --room bedroom -p room_ceiling:=two_slopes -p room_pitch_deg:=40 --count 4 --out rooms": Run(
        "scene_synth sample --room hallway -p room_ceiling:=two_slopes -p room_pitch_deg:=40 --count 1 --out sloped",
        ("sloped/room_0000.json",),
    ),
    "scene_synth sample --help": Run(),
    "scene_synth sample -p": Named(),
    "scene_synth sample --look TEXT": Named(),
    "scene_synth sample --grammar waiting_room.yaml --count 4 --out rooms": Run(makes=("rooms/room_0003.json", "rooms/room_0003.png")),
    "scene_synth sample --room living_room --seed 3 -p daylight:=clear -p solar_hour:=17.5 -p turbidity:=5 --out rooms": Run(
        makes=("rooms/room_0000.json",)
    ),
    "scene_synth catalog check DIR [--strict]": Usage(_CATALOG),
    "scene_synth learn LAYOUTS.jsonl [MORE.jsonl:0.3 ...] --room bedroom --out my_bedroom.yaml": Run(
        "scene_synth learn LAYOUTS.jsonl MORE.jsonl:1 --room bedroom --out my_bedroom.yaml --hold-out 0 --iterations 0 --corrections 0",
        ("my_bedroom.yaml",),
    ),
    # pictures
    "scene_synth render": Named(),
    "scene_synth render --preset": Named(),
    "scene_synth render --noisy": Named(),
    "scene_synth render --coco": Named(),
    "scene_synth render room.json --out pictures --annotations --coco": Run(
        "scene_synth render room.json --out pictures --annotations --coco --size 64x48 --spp 2 --frames 1",
        ("pictures/frame_0000.json", "pictures/instances.json"),
    ),
    "scene_synth render room.json --out pictures --overlay kinect_v1 -p camera.f_stop:=2 --variance": Run(
        "scene_synth render room.json --out pictures --overlay kinect_v1 -p camera.f_stop:=2 --variance --size 64x48 --spp 2 --frames 1",
        ("pictures/frame_0000.npz", "pictures/frame_0000_color.png", "pictures/trajectory.txt"),
    ),
    "scene_synth render room.json --catalog my_files --environment street.hdr --environment-yaw 90 --environment-scale 1000"
    " --out pictures": Run(
        "scene_synth render room.json --catalog my_files --environment street.hdr --environment-yaw 90 --environment-scale 1000"
        " --out pictures --size 64x48 --spp 2 --frames 1",
        ("pictures/frame_0000_color.png",),
    ),
    "scene_synth render SCENE.json --out DIR --semantic-classes ade20k": Run(
        "scene_synth render SCENE.json --out DIR --semantic-classes ade20k --size 64x48 --spp 1 --frames 1",
        ("DIR/labels.json", "DIR/frame_0000_semantic.png"),
    ),
    "scene_synth export SCENE.json room.glb": Run(makes=("room.glb",)),
    "scene_synth export SCENE.json room.sdf": Run(makes=("room.sdf", "room_meshes")),
    "scene_synth truth": Named(),
    "scene_synth run --rooms 1 --frames 60 --seed 4 --record bags/aligned"
    " -p renderer_node.streams.flow:=true -p renderer_node.streams.occlusion:=true"
    " -p renderer_node.streams.part:=true -p renderer_node.streams.material:=true": Parsed("test/scene_synth_ros/test_main_job.py"),
    "scene_synth truth bags/aligned --out truth": Parsed("the row of a bag below"),
    "scene_synth truth SCENE.json --out DIR": Run(
        "scene_synth truth SCENE.json --out truth_of_scene", ("truth_of_scene/map.yaml", "truth_of_scene/parse_graph.svg")
    ),
    "scene_synth truth BAG --out DIR": Run("scene_synth truth BAG --out truth_of_bag", ("truth_of_bag/room_0000/lights.json",)),
    "scene_synth sample --room office --seed 4 --out rooms": Run(
        "scene_synth sample --room office --seed 4 --out office_rooms && scene_synth truth office_rooms/room_0000.json --out office",
        ("office/parse_graph.svg",),
    ),
    "scene_synth truth rooms/room_0000.json --out office": Parsed("the row above"),
    "scene_synth run --record BAG --rooms 4 --truth": Parsed(
        f"{_MAIN_JOB.partition('::')[0]}::test_what_is_true_of_each_room_is_beside_the_bag"
    ),
    # exports
    "scene_synth convert BAG --to coco --out DIR": Run(
        "scene_synth convert BAG --to coco --out coco --every 8", ("coco/annotations/instances.json", "coco/annotations/panoptic.json")
    ),
    "scene_synth convert BAG --to colmap --out DIR --rooms 0:2 --every 2": Parsed(_CONVERT),
    "scene_synth convert BAG --to tum --out DIR --layers color_sensed,depth_sensed": Parsed(_CONVERT),
    "evo_traj tum DIR/room_0000/groundtruth.txt": Listed("another program; test_tum.py reads with its library"),
    "evo_traj kitti DIR/poses/00.txt": Listed("another program; test_kitti.py reads with its library"),
    ".venv/bin/python -m benchmarks --only ground_truth layers": Parsed("takes minutes; speed is never judged in a test"),
    ".venv/bin/python -m benchmarks --only convert": Parsed("takes minutes; speed is never judged in a test"),
    ".venv/bin/python examples/web_dataset.py DIR": Listed("needs a converted bag; its reading is that of test_webdataset.py"),
    # evaluation
    "scene_synth evaluate": Named(),
    "scene_synth evaluate BAG --task depth": Run(
        "scene_synth evaluate BAG --task depth --topic depth:=/synth/camera/depth/image_raw --json perfect.json", ("perfect.json",)
    ),
    "scene_synth evaluate BAG --task depth --estimates MY_BAG --topic depth:=/my/depth": Parsed(_EVALUATE),
    "scene_synth evaluate BAG --task depth --algorithm my_depth.py:estimate": Parsed(
        f"{_EVALUATE_TESTS}::test_an_algorithm_gets_its_inputs_and_its_known_error_comes_out"
    ),
    "scene_synth evaluate SWEEP --task depth --estimates MY_BAGS --by all --json evaluation.json": Parsed(
        f"{_EVALUATE_TESTS}::test_the_variants_of_a_sweep_are_told_apart_by_their_factors"
    ),
    "scene_synth evaluate BAG --task depth,poses --estimates MY_BAG --topic depth:=/my/depth --topic poses:=/my/odometry"
    " --json evaluation.json": Parsed(_EVALUATE),
    "scene_synth evaluate BAG --task depth,normals --estimates MY_BAG --baseline baseline.json --json evaluation.json": Parsed(
        f"{_EVALUATE_TESTS}::test_every_regression_fails_the_gate_and_no_clean_rerun_does"
    ),
    "scene_synth replay BAG --clock 100": Parsed(_REPLAY),
    "ros2 bag record -s mcap -o MY_BAG /my/depth /my/odometry": _ROS2CLI,
    "ros2 launch scene_synth_ros evaluate.launch.py tasks:=depth,normals estimates:=depth:=/my/depth,normals:=/my/normals"
    " out:=evaluation.json": _ROS2CLI,
    "ros2 run scene_synth_ros evaluator_node --ros-args -r __ns:=/synth -p \"tasks:=['depth']\" -p"
    " \"estimates:=['depth:=/my/depth']\"": _ROS2CLI,
    "scene_synth layers --markdown > docs/layers.md": Run(makes=("docs/layers.md",)),
    "scene_synth gallery --out docs/gallery": Parsed(f"takes minutes; {_GALLERY}"),
    "scene_synth gallery --out DIR --kind models --only chair": Run(
        "scene_synth gallery --out DIR --kind models --only book_stack --spp 1", ("DIR/models_1.jpg",)
    ),
    "scene_synth render --sensed": Named(),
    "scene_synth render room.json --out pictures --sensed --overlay realsense_d435_depth -p depth_sensor.model:=realsense_d435": Run(
        "scene_synth render room.json --out pictures --sensed --overlay realsense_d435_depth -p depth_sensor.model:=realsense_d435"
        " --size 96x72 --spp 1 --frames 1",
        ("pictures/frame_0000_depth_sensed.png",),
    ),
    "scene_synth run --overlay kinect_v2 -p renderer_node.depth_sensor.model:=kinect_v2 -p renderer_node.streams.depth_sensed:=true"
    " --record my_bag": Parsed(
        "test/scene_synth_ros/messages/test_frame_messages.py::test_true_and_sensed_depth_are_twins_and_the_settings_name_the_sensor"
    ),
    ".venv/bin/python examples/depth_sensors.py docs": Listed("takes a minute; test/renderer/sensors measures what it draws"),
    ".venv/bin/python examples/every_layer.py docs": Run(".venv/bin/python examples/every_layer.py docs 1", ("docs/layers.jpg",)),
    ".venv/bin/pip install '.[bench-alignment]'": Listed("needs the network; that the extra exists is tested"),
    ".venv/bin/pip install '.[evaluate]'": Listed("needs the network; that the extra exists is tested"),
    ".venv/bin/pip install '.[examples]'": Listed("needs the network; that the extra exists is tested"),
    ".venv/bin/python examples/diagnose.py rgbd_odometry": Listed("takes minutes; test/test_worked_examples.py tests what it runs"),
    ".venv/bin/python examples/diagnose.py stereo_matching": Listed("takes minutes; test/test_worked_examples.py tests what it runs"),
    ".venv/bin/python examples/diagnose.py orb_odometry": Listed("takes minutes; test/test_worked_examples.py tests what it runs"),
    ".venv/bin/python examples/diagnose.py stereo_study": Listed("takes minutes; test/test_worked_examples.py tests what it runs"),
    "chromium --headless=new --hide-scrollbars --window-size=1300,1500 --virtual-time-budget=10000 --screenshot=docs/examples.jpg"
    ' "file://$PWD/runs/stereo_matching/report.html"': Listed("needs chromium; makes the picture of the page"),
    ".venv/bin/python -m benchmarks.physics --rooms 2 --all": Parsed("needs MuJoCo, which is not installed"),
    ".venv/bin/python -m benchmarks.alignment_bench bags/aligned truth/room_0000/scene.glb": Parsed("needs Open3D, which is large"),
    ".venv/bin/python examples/lights_and_lenses.py docs": Run(
        ".venv/bin/python examples/lights_and_lenses.py docs 1 64", ("docs/lights.jpg", "docs/lenses.jpg")
    ),
    ".venv/bin/python examples/color_sensor.py docs": Run(".venv/bin/python examples/color_sensor.py docs 1", ("docs/color_sensor.jpg",)),
    ".venv/bin/pip install '.[train]'": Listed("needs the network; that the extra exists is tested"),
    ".venv/bin/python -m examples.train_normals --out docs": Listed("takes minutes; test/test_train_normals.py runs its parts"),
    # scene_synth generate on many machines, estimate
    "scene_synth estimate": Named(),
    "scene_synth estimate --rooms 100000 --params ground_truth --machines 20": Parsed(_ESTIMATE),
    "scene_synth estimate --rooms 1000000 --overlay balanced --machines 100 --sample 16 --json": Parsed(_ESTIMATE),
    "scene_synth generate --rooms 5000 --seed 1 --params ground_truth --out s3://my-bucket/rooms": Parsed(_SHARES),
    "scene_synth generate --rooms 5000 --seed 1 --params ground_truth --out runs/rooms --ray": Parsed(_OWN_RAY),
    "scene_synth generate --rooms 5000 --seed 1 --params ground_truth --out s3://my-bucket/rooms --ray auto": Parsed(_RAY),
    "scene_synth generate --rooms 5000 --seed 1 --params ground_truth --out s3://my-bucket/rooms --ray 10.0.0.1:6379": Parsed(_RAY),
    "scene_synth generate --rooms 5000 --seed 1 --params ground_truth --out runs/shared --shard 0/4": Parsed(_SHARES),
    "scene_synth generate --rooms 5000 --seed 1 --params ground_truth --out runs/shared --shard 1/4": Parsed(_SHARES),
    "scene_synth generate --out runs/shared --finish": Parsed(_SHARES),
    ".venv/bin/python -m benchmarks.cost_bench --rooms 12 --write": Parsed("takes an hour; speed is never judged in a test"),
    ".venv/bin/pip install '.[cloud]'": Listed("needs the network; that the extra exists is tested"),
    ".venv/bin/pip install '.[ray]'": Listed("needs the network; that the extra exists is tested"),
    # the program from within
    ".venv/bin/python -m pytest test/renderer/path": Listed("is how this test runs; that the folder exists is tested in test/test_docs.py"),
    ".venv/bin/python -m benchmarks --only dataset": Parsed("takes minutes, and speed is never judged in a test"),
    ".venv/bin/python -m benchmarks --only layout": Parsed("takes minutes, and speed is never judged in a test"),
    ".venv/bin/python -m benchmarks.color_bench --gathering 1": Parsed("takes minutes; its figures: test_color_bench.py"),
    ".venv/bin/python -m benchmarks.color_bench --noise 2 --json before.json": Parsed("takes minutes; its figures: test_color_bench.py"),
    ".venv/bin/python -m benchmarks.color_bench --noise 2 --beside before.json": Parsed("takes minutes; its figures: test_color_bench.py"),
    ".venv/bin/python -m benchmarks.pictures": Parsed("takes minutes; test/benchmarks/test_pictures.py has its measures"),
    ".venv/bin/python -m benchmarks.pictures --rooms 3 --size 640x480 --overlay phone --write": Parsed(
        "takes minutes; test/benchmarks/test_pictures.py has its measures"
    ),
    ".venv/bin/python -m benchmarks.pictures --rooms 1 --size 1280x720 --overlay phone --page": Parsed(
        "takes minutes; test/benchmarks/test_pictures.py has its measures"
    ),
    ".venv/bin/python -m benchmarks.pictures --views 24 --write": Parsed(
        "takes minutes; test/benchmarks/test_pictures.py has its measures"
    ),
    ".venv/bin/python -m benchmarks.cache_bench --write": Parsed("takes minutes; speed is never judged in a test"),
    ".venv/bin/python -m benchmarks --only camera_rate": Parsed("takes minutes; speed is never judged in a test"),
    ".venv/bin/python -m benchmarks.camera_rate_bench --rooms 2 --references REFERENCES --write": Parsed("takes hours at first"),
    ".venv/bin/python -m benchmarks.cache_bench all --rooms 2 --references REFERENCES --write": Parsed("takes hours at first"),
    ".venv/bin/python -m benchmarks.cache_bench picture --references REFERENCES": Parsed("takes minutes"),
    ".venv/bin/python -m benchmarks.unseen_bench --write": Parsed("takes hours"),
    ".venv/bin/python -m benchmarks.rate_curves_bench --clock --write": Parsed("speed is never judged in a test"),
    ".venv/bin/python -m benchmarks.walk_bench flicker --references REFERENCES --write": Parsed("takes an hour at first"),
    ".venv/bin/pip install '.[bench-perception]'": Listed("needs the network; that the extra exists is tested"),
    ".venv/bin/python -m benchmarks.walk_bench perception --references REFERENCES --write": Parsed("needs Open3D, which is large"),
    ".venv/bin/python -m benchmarks --only presets": Parsed("takes minutes; test/renderer/path/test_clipping.py has known answers"),
    ".venv/bin/python -m benchmarks.realism_bench LAYOUTS.jsonl --folds 5 --rooms 60 --counted 300 --workers 2 --write": Parsed(
        "takes minutes; test/grammar/learning/test_realism_figures.py has its figures"
    ),
    ".venv/bin/python -c 'from grammar.checks.faults import faults_table; print(faults_table())'": Run(),
    ".venv/bin/python -m benchmarks.rooms_bench --rooms 1000 --real LAYOUTS.jsonl --sheets sheets": Parsed(
        "takes minutes; test/benchmarks/test_rooms_bench.py has its measures"
    ),
    ".venv/bin/python -m benchmarks.rooms_bench --clutter": Parsed(
        "takes minutes; test/grammar/small_things/test_strew.py has what it counts"
    ),
    ".venv/bin/python -m benchmarks.realism_bench LAYOUTS.jsonl --classifier --workers 2 --write": Parsed(
        "takes minutes; test/grammar/learning/test_room_features.py has its figures"
    ),
    ".venv/bin/python -m benchmarks.sources_bench LAYOUTS.jsonl MORE.jsonl:0.2 --types bedroom --mixed --shipped --workers 2"
    " --write": Parsed("takes minutes; test/grammar/learning/test_learn.py learns"),
    ".venv/bin/python -m benchmarks.realism_bench --recovery": Parsed("test/grammar/learning/test_learn.py"),
    ".venv/bin/python -m benchmarks.reference --pictures docs/reference": Parsed("takes an hour, and needs Mitsuba"),
    ".venv/bin/python -m benchmarks.export_bench": Parsed("needs Mitsuba; test/renderer/export reads the files"),
}
