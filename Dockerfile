# docker build -t scene_synth_ros . && mkdir -p runs && docker run --rm --user "$(id -u)" --shm-size 1g -v "$PWD/runs:/runs" scene_synth_ros
FROM ros:jazzy-ros-base
RUN apt-get update && apt-get install -y --no-install-recommends python3-venv && rm -rf /var/lib/apt/lists/*
WORKDIR /ws
COPY . src/scene_synth_ros
RUN apt-get update && rosdep update && rosdep install --from-paths src --ignore-src -y && rm -rf /var/lib/apt/lists/* \
    && python3 -m venv --system-site-packages .venv && touch .venv/COLCON_IGNORE \
    && .venv/bin/pip install --no-cache-dir -r src/scene_synth_ros/requirements.txt "pyoidn>=2.5" \
    && bash -c "source /opt/ros/jazzy/setup.bash && colcon build"
ENV PATH=/ws/.venv/bin:$PATH NUMBA_CACHE_DIR=/tmp/kernels
# not root; by --user the container writes into a folder of the host as whoever owns that
ENV HOME=/tmp ROS_LOG_DIR=/tmp/log
USER ubuntu
# ROS's own entry point sources /opt/ros/jazzy only
ENTRYPOINT ["bash", "-c", "source /opt/ros/jazzy/setup.bash && source /ws/install/setup.bash && exec \"$@\"", "--"]
CMD ["ros2", "run", "scene_synth_ros", "scene_synth", "demo", "--no-open", "--out", "/runs/demo"]
