# The workspace on ROS 2 Jazzy from apt. Unverified: no image could be pulled where it was written.
FROM ros:jazzy-ros-base
SHELL ["/bin/bash", "-o", "pipefail", "-c"]
# the image's snapshot of the archive pins them
# hadolint ignore=DL3008
RUN apt-get update \
    && apt-get install --yes --no-install-recommends make python3-venv \
    && rm -rf /var/lib/apt/lists/*
# the user `ubuntu` of the image
COPY --chown=1000:1000 . /auv_gvc
USER 1000
WORKDIR /auv_gvc
# with ROS sourced, `make` takes it in place of the wheels
RUN source /opt/ros/jazzy/setup.bash && make setup
ENV PATH="/auv_gvc/.venv/bin:${PATH}"
# the image's entrypoint sources ROS
CMD ["auv", "run", "case1", "--overwrite"]
