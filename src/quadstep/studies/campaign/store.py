"""The folder of a campaign: Parquet files of flights as they finish, and a manifest that lists them with their digests."""

import contextlib
import hashlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from quadstep.io import files
from quadstep.io.errors import UserError
from quadstep.io.results_folder import Folder
from quadstep.io.run_record import RunRecord
from quadstep.io.run_record import opened as open_record
from quadstep.studies.campaign.flyer import FLIGHT, OUTCOME, SUCCESS, TIME, Chunk, judged, load_arrow
from quadstep.studies.campaign.manifest import FLIGHTS, MANIFEST, CampaignManifest, cannot_continue, machine, new_manifest
from quadstep.studies.campaign.schema import Campaign

load_arrow()  # before anything makes an array


class Store(RunRecord):
    """The folder of one campaign, which one run has for itself. Made by `opened`."""

    NAME, SCHEMA, WHAT, ITEMS, INNER = MANIFEST, CampaignManifest, "campaign", "files of flights", (FLIGHTS,)

    def __init__(self, files: Folder, manifest: dict[str, object]) -> None:
        super().__init__(files, manifest)
        self.digests: dict[str, dict[str, int | str]] = {one["file"]: one for one in self.manifest["chunks"]}

    @property
    def names(self) -> list[str]:
        """The files that the manifest names: of flights, and of the report."""
        return [*self.digests, *super().names]

    @property
    def finished(self) -> int:
        return len(self.present)

    @property
    def flights(self) -> int:
        return self.manifest["flights"]

    @property
    def chunks(self) -> list[Chunk]:
        """All files, in order, whether present or not."""
        return [self.chunk(i) for i in range(self.count)]

    @property
    def count(self) -> int:
        return len(range(0, self.flights, self.manifest["chunk"]))

    def chunk(self, i: int) -> Chunk:
        size: int = self.manifest["chunk"]
        return Chunk(f"{FLIGHTS}/{i:05d}.parquet", i * size, min(i * size + size, self.flights))

    @property
    def present(self) -> list[Chunk]:
        """The files that are present, in order; a manifest may claim millions that are not."""
        named = {int(one["first"]) // self.manifest["chunk"] for one in self.digests.values()}
        return [chunk for chunk in map(self.chunk, sorted(i for i in named if 0 <= i < self.count)) if self.has(chunk)]

    @property
    def missing(self) -> list[Chunk]:
        """The files still to be flown."""
        return [chunk for chunk in self.chunks if not self.has(chunk)]

    def has(self, chunk: Chunk) -> bool:
        """Whether a file is present, with all its flights."""
        known = self.digests.get(chunk.file, {})
        return (known.get("first"), known.get("past")) == chunk[1:] and self.files.status(chunk.file) is not None

    def write(self, chunk: Chunk, table: pa.Table) -> None:
        """Add a file, and then name it in the manifest. Raises UserError if it cannot be written."""
        content = parquet(table)
        digest: dict[str, int | str] = {
            "file": chunk.file,
            "first": chunk.first,
            "past": chunk.past,
            "sha256": hashlib.sha256(content).hexdigest(),
        }
        with self.explained():
            self.files.write(chunk.file, content)
            self.digests[chunk.file] = digest
            self.save()

    def save(self, **more: object) -> None:
        """Write the manifest. Raises UserError."""
        super().save(**more, chunks=[self.digests[name] for name in sorted(self.digests)])

    def read(self, columns: Sequence[str] | None = None) -> pa.Table:
        """The finished flights, in order. Raises UserError for a file that cannot be read."""
        tables = [self.read_chunk(chunk, columns) for chunk in self.present]
        try:
            return pa.concat_tables(tables, promote_options="permissive").unify_dictionaries()
        except pa.ArrowException as error:
            raise UserError(f"{self.folder / FLIGHTS}: files from different campaigns: {error}") from None

    def read_chunk(self, chunk: Chunk, columns: Sequence[str] | None = None) -> pa.Table:
        """The flights of one file. Raises UserError."""
        path = self.folder / chunk.file
        with self.files.file(chunk.file, files.FLIGHTS) as file:
            try:
                parquet = pq.ParquetFile(file)
                check_kind(path, parquet.metadata, chunk, columns or (*KINDS, *self.manifest["metrics"]))
                table = parquet.read(columns=None if columns is None else list(columns))
            except (OSError, ValueError, pa.ArrowException) as error:
                raise UserError(f"{path}: cannot be read: {error}") from None
        if any(table[name].null_count for name in table.column_names if name not in (TIME, *self.manifest["metrics"])):
            raise not_flights(path, chunk)
        return table

    def shorten(self, flights: int) -> None:
        """Forget and remove files of flights beyond this number, left from a longer run. Raises UserError."""
        self.manifest["flights"] = flights
        wanted = {chunk.file for chunk in self.chunks}
        with self.explained():
            for name in self.digests.keys() - wanted:
                del self.digests[name]
                self.files.remove(name)

    def judge_again(self, campaign: Campaign) -> None:
        """Rewrite the existing flights with the campaign's current definition of success. Raises UserError."""
        for chunk in self.present:
            table = judged(self.read_chunk(chunk), campaign)
            del self.digests[chunk.file]
            self.save()  # a run that is killed before the next time flies this file again
            self.write(chunk, table)

    def verify(self) -> None:
        """Raises UserError for a file whose content is not what was written."""
        for chunk in self.present:
            with self.files.file(chunk.file, files.FLIGHTS) as file:
                digest = hashlib.file_digest(file, "sha256").hexdigest()
            if digest != self.digests[chunk.file]["sha256"]:
                raise UserError(
                    f"{self.folder / chunk.file}: corrupted (its content is not what was written); delete this file, and "
                    f"--resume flies flights {chunk.first} to {chunk.past - 1} again"
                )


@contextlib.contextmanager
def opened(
    folder: Path, campaign: Campaign, flights: int, engine: str, resume: bool = False, overwrite: bool = False
) -> Iterator[Store]:
    """The folder of a campaign, created or resumed, and locked while the block runs.

    Raises UserError: for a folder that holds something else or another campaign, a campaign that has changed, a corrupted
    file, a folder that another run is writing into. Raises InterruptedRun on Ctrl-C.
    """
    mine = new_manifest(campaign, flights, engine)

    def changed(manifest: Mapping[str, object]) -> list[str]:
        """Why a campaign cannot be resumed."""
        same = all(manifest.get(key, mine[key] if key == "metrics" else None) == mine[key] for key in ("chunk", "metrics"))
        return [*cannot_continue(manifest, campaign), *([] if same else ["its manifest has changed"])]

    with open_record(Store, folder, mine, changed, resume, overwrite) as (store, resumed):
        if resumed:
            go_on(store, campaign, flights, mine)
        yield store


def go_on(store: Store, campaign: Campaign, flights: int, mine: Mapping[str, object]) -> None:
    """Prepare a campaign that is resumed. mine: the manifest as it would be now. Raises UserError for a corrupted file."""
    manifest = store.manifest
    manifest.setdefault("metrics", mine["metrics"])
    store.verify()
    store.shorten(flights)
    if manifest.get("failure") != mine["failure"]:
        manifest["failure"] = None  # until all are judged: a run that is killed meanwhile judges them again
        store.judge_again(campaign)
    here, machines = machine(), manifest["machines"]
    machines = machines if here in machines else [*machines, here]
    store.save(
        **{key: mine[key] for key in ("name", "campaign", "flights", "failure", "engine", "complete")}, machines=machines
    )


KINDS = {FLIGHT: "int64", OUTCOME: "dictionary", TIME: "double", SUCCESS: "bool"}
"""Columns that every campaign has, and what the names of their types begin with."""


def check_kind(path: Path, about: pq.FileMetaData, chunk: Chunk, columns: Iterable[str]) -> None:
    """Refuses a file without these columns, or with other flights, before it is read. Raises UserError."""
    size = sum(about.row_group(i).total_byte_size for i in range(about.num_row_groups))
    kinds = {field.name: str(field.type) for field in about.schema.to_arrow_schema()}
    good = all(name in kinds and kinds[name].startswith(KINDS.get(name, "")) for name in columns)
    if about.num_rows != chunk.past - chunk.first or not good or size > 4 * files.FLIGHTS.most:
        raise not_flights(path, chunk)


def not_flights(path: Path, chunk: Chunk) -> UserError:
    """The error for a file with other content."""
    return UserError(f"{path}: does not hold flights {chunk.first} to {chunk.past - 1}; delete it, and --resume")


def parquet(table: pa.Table) -> bytes:
    """A table as the content of a Parquet file, the same bytes for the same table."""
    sink = pa.BufferOutputStream()
    pq.write_table(table, sink, compression="zstd", version="2.6")
    return sink.getvalue().to_pybytes()
