#!/usr/bin/env python3
"""Lets an exported model fall on a floor in MuJoCo, and draws it: drop.py FOLDER [--pictures OUT]

FOLDER is what `pliant export MODEL --to mujoco --out FOLDER` wrote. Needs `pip install mujoco`, and Pillow for the pictures."""
import argparse
import pathlib
import xml.etree.ElementTree as ET

import mujoco
import numpy as np

HEIGHT = 0.15  # [m] of the lowest vertex above the floor at the start


def scene(folder):
    """The exported model with a floor below it that it meets: contacts of the export are switched off."""
    root = ET.parse(folder / "model.xml").getroot()
    vertices = np.array([[float(x) for x in body.get("pos").split()] for body in root.find("worldbody").iter("body") if body.get("pos")])
    up = -np.array([float(x) for x in root.find("option").get("gravity").split()])
    up /= np.linalg.norm(up)
    lowest = (vertices @ up).min()
    middle = vertices.mean(axis=0)
    floor = middle + up * (lowest - HEIGHT - middle @ up)
    world = root.find("worldbody")
    ET.SubElement(world, "geom", type="plane", size="1 1 0.1", pos=" ".join(map(str, floor)), zaxis=" ".join(map(str, up)), rgba="0.6 0.62 0.66 1")
    ET.SubElement(world, "light", pos=" ".join(map(str, middle + 1.5 * up)), dir=" ".join(map(str, -up)), directional="true")
    visual = ET.SubElement(root, "visual")
    ET.SubElement(visual, "headlight", ambient="0.45 0.45 0.45", diffuse="0.5 0.5 0.5")
    ET.SubElement(ET.SubElement(root, "asset"), "texture", type="skybox", builtin="gradient", rgb1="0.97 0.98 1", rgb2="0.8 0.85 0.9", width="64", height="384")
    side = np.cross(up, [0.0, 0.0, 1.0] if abs(up[2]) < 0.9 else [1.0, 0.0, 0.0])
    side /= np.linalg.norm(side)
    eye = 0.9 * np.cross(side, up) + 0.35 * up  # from aside and above
    back = eye / np.linalg.norm(eye)
    target = floor + 0.12 * up
    ET.SubElement(world, "camera", name="view", pos=" ".join(map(str, target + eye)), xyaxes=" ".join(map(str, np.r_[np.cross(up, back), np.cross(back, np.cross(up, back))])))
    for contact in root.iter("contact"):
        contact.set("contype", "1"), contact.set("conaffinity", "1")
        contact.set("solref", "0.005 1"), contact.set("solimp", "0.95 0.99 0.001")  # harder than MuJoCo's own: the ring is light
    for flex in root.iter("flex"):
        flex.set("rgba", "0.35 0.55 0.75 1")
    return mujoco.MjModel.from_xml_string(ET.tostring(root, encoding="unicode")), up, floor


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--pictures", type=pathlib.Path, help="folder for pictures of the fall")
    parser.add_argument("--duration", type=float, default=0.5, help="[s]")
    arguments = parser.parse_args()
    model, up, floor = scene(arguments.folder)
    data = mujoco.MjData(model)
    renderer = mujoco.Renderer(model, 360, 480) if arguments.pictures else None
    frames = []
    for step in range(int(arguments.duration / model.opt.timestep) + 1):
        mujoco.mj_step(model, data)
        heights = (data.flexvert_xpos - floor) @ up
        if step % 25 == 0:
            print(f"{data.time:.2f} s  lowest {1e3 * heights.min():6.1f} mm  height of the object {1e3 * np.ptp(heights):6.1f} mm", flush=True)
            if renderer:
                renderer.update_scene(data, camera="view")
                frames.append(renderer.render().copy())
    if renderer:
        from PIL import Image
        arguments.pictures.mkdir(parents=True, exist_ok=True)
        chosen = frames[:: max(1, len(frames) // 4)][:4]
        Image.fromarray(np.concatenate(chosen, axis=1)).save(arguments.pictures / "drop.png")
        print(arguments.pictures / "drop.png")


if __name__ == "__main__":
    main()
