"""Writes tests/imports/data with the formats' own libraries: see data/README.md for versions and the command.

All depth images show the same picture: 600 + u + 2 v + floor(u v / 6) + 100 frame millimetres, and no reading at pixel (0, 0)."""
import pathlib
import shutil
import struct
import sys
import zlib

import numpy as np

DATA = pathlib.Path(__file__).resolve().parent / "data"
WIDTH, HEIGHT, FRAMES = 24, 18, 4
FX, FY, CX, CY = 30.0, 31.0, 11.5, 8.5


def ramp(frame):
    v, u = np.mgrid[0:HEIGHT, 0:WIDTH]
    depth = (600 + u + 2 * v + u * v // 6 + 100 * frame).astype(np.uint16)
    depth[0, 0] = 0
    return depth


def png16(pixels):
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    height, width = pixels.shape
    rows = b"".join(b"\0" + row.astype(">u2").tobytes() for row in pixels)
    header = struct.pack(">IIBBBBB", width, height, 16, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def bags():
    from rosbags.rosbag1 import Writer as Writer1
    from rosbags.rosbag2 import StoragePlugin, Writer as Writer2
    from rosbags.typesys import Stores, get_typestore

    def messages(store, encoding, is_ros2, scale=1):
        t = store.types
        Header, Time = t["std_msgs/msg/Header"], t["builtin_interfaces/msg/Time"]

        def header(frame):
            stamp = Time(sec=1000 + frame, nanosec=250000000)
            return Header(stamp=stamp, frame_id="optical") if is_ros2 else Header(seq=frame, stamp=stamp, frame_id="optical")

        K = np.array([FX, 0, CX, 0, FY, CY, 0, 0, 1.0])
        P = np.array([FX + 1, 0, CX + 2, 0, 0, FY + 3, CY + 4, 0, 0, 0, 1.0, 0])  # of rectified images
        D = np.array([0.1, -0.02, 0.001, 0.002, 0.0])
        roi = t["sensor_msgs/msg/RegionOfInterest"](x_offset=0, y_offset=0, height=0, width=0, do_rectify=False)
        names = dict(d=D, k=K, r=np.eye(3).ravel(), p=P) if is_ros2 else dict(D=D, K=K, R=np.eye(3).ravel(), P=P)
        info = t["sensor_msgs/msg/CameraInfo"](header=header(0), height=HEIGHT, width=WIDTH, distortion_model="plumb_bob",
                                               binning_x=0, binning_y=0, roi=roi, **names)
        images = []
        for frame in range(FRAMES):
            depth = ramp(frame)
            if encoding == "32FC1":
                pixels = np.where(depth > 0, depth / 1000.0, np.nan).astype(np.float32)
            elif encoding == "rgb8":
                pixels = np.repeat((depth // 8).astype(np.uint8)[:, :, None], 3, axis=2)
            else:
                pixels = (depth * scale).astype(np.uint16)
            data = np.frombuffer(pixels.tobytes(), np.uint8)
            images.append(t["sensor_msgs/msg/Image"](header=header(frame), height=HEIGHT, width=WIDTH, encoding=encoding,
                                                     is_bigendian=0, step=len(data) // HEIGHT, data=data))
        return info, images

    store = get_typestore(Stores.ROS1_NOETIC)
    IMAGE, INFO, FLOAT = "sensor_msgs/msg/Image", "sensor_msgs/msg/CameraInfo", "std_msgs/msg/Float32"

    def bag(name, encoding, topics, compression=None, unit=None, scale=1):
        path = DATA / name
        path.unlink(missing_ok=True)
        info, images = messages(store, encoding, False, scale)
        writer = Writer1(path)
        if compression:
            writer.set_compression(compression)
        with writer:
            image_topic = writer.add_connection(topics[0], IMAGE, typestore=store)
            info_topic = writer.add_connection(topics[1], INFO, typestore=store)
            writer.write(info_topic, 10**9, store.serialize_ros1(info, INFO))
            if unit:
                option = writer.add_connection(unit[0], FLOAT, typestore=store)
                writer.write(option, 10**9, store.serialize_ros1(store.types[FLOAT](data=unit[1]), FLOAT))
            for frame, image in enumerate(images):
                writer.write(image_topic, 10**9 * (2 + frame), store.serialize_ros1(image, IMAGE))

    def compressed_bag(name):
        """compressedDepth as image_transport writes it: twelve bytes of configuration before a PNG."""
        COMPRESSED = "sensor_msgs/msg/CompressedImage"
        path = DATA / name
        path.unlink(missing_ok=True)
        info, images = messages(store, "16UC1", False)
        with Writer1(path) as writer:
            image_topic = writer.add_connection("/camera/depth/image_raw/compressedDepth", COMPRESSED, typestore=store)
            info_topic = writer.add_connection("/camera/depth/camera_info", INFO, typestore=store)
            writer.write(info_topic, 10**9, store.serialize_ros1(info, INFO))
            for frame, image in enumerate(images):
                data = np.frombuffer(bytes(12) + png16(ramp(frame)), np.uint8)
                message = store.types[COMPRESSED](header=image.header, format="16UC1; compressedDepth png", data=data)
                writer.write(image_topic, 10**9 * (2 + frame), store.serialize_ros1(message, COMPRESSED))

    raw = "/camera/depth/image_raw", "/camera/depth/camera_info"
    compressed_bag("compressed.bag")
    bag("plain.bag", "16UC1", raw)
    bag("bz2.bag", "16UC1", raw, Writer1.CompressionFormat.BZ2)
    bag("lz4.bag", "16UC1", raw, Writer1.CompressionFormat.LZ4)
    bag("metres.bag", "32FC1", ("/camera/depth/image_rect", "/camera/depth/camera_info"), Writer1.CompressionFormat.BZ2)
    bag("colours.bag", "rgb8", raw, Writer1.CompressionFormat.BZ2)
    sdk = "/device_0/sensor_0/Depth_0/image/data", "/device_0/sensor_0/Depth_0/info/camera_info"
    bag("viewer.bag", "mono16", sdk, Writer1.CompressionFormat.LZ4, ("/device_0/sensor_0/option/Depth Units/value", 0.0001), 10)
    bag("no_unit.bag", "mono16", sdk, Writer1.CompressionFormat.LZ4)

    store = get_typestore(Stores.ROS2_HUMBLE)
    folder = DATA / "humble"
    shutil.rmtree(folder, ignore_errors=True)
    info, images = messages(store, "16UC1", True)
    with Writer2(folder, version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
        image_topic = writer.add_connection(raw[0], IMAGE, typestore=store)
        info_topic = writer.add_connection(raw[1], INFO, typestore=store)
        writer.write(info_topic, 10**9, store.serialize_cdr(info, INFO))
        for frame, image in enumerate(images):
            writer.write(image_topic, 10**9 * (2 + frame), store.serialize_cdr(image, IMAGE))


def record3d():
    """A .r3d of Record3D's layout, compressed by Apple's own LZFSE; 96 x 72 pixels, so that blocks are not LZVN's."""
    import hashlib
    import json
    import zipfile

    import liblzfse

    width, height, frames = 96, 72, 3
    v, u = np.mgrid[0:height, 0:width]
    poses = [[0, 0, 0, 1, 0.1 * k, 0.0, 0.0] for k in range(frames)]
    metadata = {"w": 4 * width, "h": 4 * height, "dw": width, "dh": height, "fps": 60,
                "K": [400.0, 0, 0, 0, 404.0, 0, 191.5, 143.5, 1], "poses": poses,
                "frameTimestamps": [10.0, 10.1, 10.25]}
    with zipfile.ZipFile(DATA / "phone.r3d", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("metadata", json.dumps(metadata), zipfile.ZIP_STORED)
        for frame in range(frames):
            metres = ((600 + u + 2 * v + u * v // 6 + 100 * frame) / 1000).astype(np.float32)
            metres[0, 0] = np.nan
            sure = np.full((height, width), 2, np.uint8)
            sure[5, 7] = 0
            archive.writestr(f"rgbd/{frame}.depth", liblzfse.compress(metres.tobytes()), zipfile.ZIP_STORED)
            archive.writestr(f"rgbd/{frame}.conf", liblzfse.compress(sure.tobytes()))
    sums = []
    rng = np.random.default_rng(3)
    noise = rng.integers(0, 256, 5000, np.uint8).tobytes()
    text = b"soft objects sag, swing and bounce; " * 40
    for name, data in (("stored", noise), ("lzvn", text), ("mixed", noise[:900] * 30 + text * 50 + noise)):
        (DATA / f"{name}.lzfse").write_bytes(liblzfse.compress(data))
        sums.append(f"{name} {hashlib.sha256(data).hexdigest()}\n")
    (DATA / "lzfse_sha256.txt").write_text("".join(sums))


def markers():
    """Three markers in five frames at 200 Hz, millimetres; the second is not seen in frame 3."""
    import c3d
    import ezc3d

    frames = np.arange(5)[:, None]
    xyz = np.array([[[10.0, 20.0, 30.0], [-40.0, 50.0, 60.0], [70.0, -80.0, 90.5]]]) + frames[:, :, None] * [1.0, 2.0, 0.5]
    xyz[3, 1] = np.nan
    file = ezc3d.c3d()
    file["parameters"]["POINT"]["RATE"]["value"] = [200.0]
    file["parameters"]["POINT"]["UNITS"]["value"] = ["mm"]
    file["parameters"]["POINT"]["LABELS"]["value"] = ["tip", "side", "base"]
    points = np.ones((4, 3, 5))
    points[:3] = xyz.transpose(2, 1, 0)
    file["data"]["points"] = points
    file.write(str(DATA / "ezc3d.c3d"))
    writer = c3d.Writer(point_rate=200.0, point_units="mm ")
    writer.set_point_labels(["tip ", "side", "base"])
    for frame in range(5):
        row = np.zeros((3, 5), np.float32)
        row[:, :3] = np.nan_to_num(xyz[frame])
        row[np.isnan(xyz[frame]).any(axis=1), 3] = -1
        writer.add_frames([(row, np.array([[]]))])
    with open(DATA / "py_c3d.c3d", "wb") as out:
        writer.write(out)


if __name__ == "__main__":
    DATA.mkdir(exist_ok=True)
    for name in sys.argv[1:]:
        globals()[name]()
