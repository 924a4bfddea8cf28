"""Bags as readers see them that are not our own."""

import warnings

from mcap.reader import make_reader
from mcap.stream_reader import StreamReader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader


def read_rosbags(folder):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with AnyReader([folder]) as reader:
            found = [(connection.topic, stamp, bytes(data)) for connection, stamp, data in reader.messages()]
            topics = {connection.topic: connection for connection in reader.connections}
            return found, topics


def read_mcap(path, **options):
    with warnings.catch_warnings(), path.open("rb") as file:
        warnings.simplefilter("error")
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        return reader.get_header(), reader.get_summary(), list(reader.iter_metadata()), list(reader.iter_decoded_messages(**options))


def count_in_stream(path):
    count = 0
    with path.open("rb") as file:
        try:
            for record in StreamReader(file, validate_crcs=True).records:
                count += type(record).__name__ == "Message"
        except Exception as error:
            assert type(error).__name__ == "EndOfFile"
    return count
