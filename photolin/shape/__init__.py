"""From linearized bases to lights, normals, albedo, depth and meshes.

Without known lights the linearized bases b (3,H,W) fix the surface only up to a 3x3 matrix: with
n = M b, unit normal times albedo, the lights are s_k = c_k M^-1 (row vectors), for
c_k . b = s_k . n whatever M is. Modules named for what is known of the scene find M; others use it.

Space is x right, y up, z to the camera; the camera is orthographic. Pixels are (row, column).
"""
