# What jobs run in on a cluster of containers; not as root.
#
#   docker build --build-arg TORCH="--index-url URL" -t REGISTRY/dreammat:cpu .      URL: PyTorch's index of wheels for CPUs
#   docker build --build-arg VARIANT=cuda -t REGISTRY/dreammat:cuda .                for --guidance sd

ARG VARIANT=cpu

FROM python:3.11-slim-bookworm AS base
# what pymeshlab and embreex load, and git, with which Snakemake finds what to take along
# hadolint ignore=DL3008
RUN apt-get update \
    && apt-get install --yes --no-install-recommends git libegl1 libgl1 libglib2.0-0 libgomp1 libopengl0 \
    && rm -rf /var/lib/apt/lists/* \
    && useradd --create-home --uid 1000 dreammat
ENV PIP_NO_CACHE_DIR=1 PIP_DISABLE_PIP_VERSION_CHECK=1 PYTHONUNBUFFERED=1
WORKDIR /opt/dreammat
COPY pyproject.toml constraints.txt README.md LICENSE ./
COPY dreammat_cli dreammat_cli
COPY stages stages

FROM base AS cpu
ARG TORCH=""
# hadolint ignore=SC2086
RUN pip install $TORCH --constraint constraints.txt torch==2.13.0
ENV EXTRAS=batch,fbx,gltf,usd,materialx,web

FROM base AS cuda
ENV EXTRAS=batch,sd,fbx,gltf,usd,materialx,web NVIDIA_VISIBLE_DEVICES=all NVIDIA_DRIVER_CAPABILITIES=compute,utility

# hadolint ignore=DL3006
FROM ${VARIANT}
RUN pip install --no-cache-dir --constraint constraints.txt ".[${EXTRAS}]" \
      snakemake-executor-plugin-kubernetes==0.5.1 snakemake-storage-plugin-s3==0.3.6
USER 1000
WORKDIR /home/dreammat
COPY --chown=1000 examples/urn.py ./
# kernels are compiled here, into the user's cache, and not in every job
RUN python urn.py urn.obj && dreammat run urn.obj --prompt copper -o tiny -q --with conditions "--views 1 --size 64" \
      --with distill "--steps 1" --with bake "--size 512" && rm -r tiny urn.obj
CMD ["dreammat", "doctor"]
