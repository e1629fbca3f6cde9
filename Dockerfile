# The core of quadstep as a command, for any user id, on a read-only system. Build and run, with Docker or Podman:
#
#   docker build -t quadstep .
#   docker run --rm --read-only --user "$(id -u):$(id -g)" -v "$PWD:/work" quadstep reproduce
#
# Results go to the folder that is mounted at /work, which that user must be able to write. Nothing else is written.
ARG PYTHON=3.13

FROM python:${PYTHON}-slim AS build
WORKDIR /build
COPY requirements/core.lock requirements/
RUN python -m venv --without-pip /opt/quadstep \
    && python -m pip --python /opt/quadstep/bin/python install --no-cache-dir --only-binary :all: --require-hashes -r requirements/core.lock
COPY pyproject.toml README.md LICENSE ./
COPY src src
RUN python -m pip --python /opt/quadstep/bin/python install --no-cache-dir --no-deps --no-build-isolation .

FROM python:${PYTHON}-slim
COPY --from=build /opt/quadstep /opt/quadstep
ENV PATH=/opt/quadstep/bin:$PATH PYTHONDONTWRITEBYTECODE=1
WORKDIR /work
USER 65534:65534
ENTRYPOINT ["quadstep"]
CMD ["--help"]
