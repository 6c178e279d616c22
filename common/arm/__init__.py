"""Simulated arm, tool, receptacle and water: the only importer of mujoco, dm_control and mink.

    robot_file, cell ── arm, receptacle ── scene ── Simulation      what a robot and its surroundings do
                        kinematics ── Servo                   what makes an arm follow accelerations
                                      preflight, rendering

The simulated world is the vehicle that carries the arm: the arm's base stands still in it, and everything else
sways (see `simulation`). Poses are points of `farhand.common.model.manifold.POSE`.

    receptacle's frame: origin in the mouth's centre, z into the bore, x to the right and y down as the arm sees it
    tool's frame:       origin at the plug's tip, z forwards; seated, it is the receptacle's, one depth further in
"""
