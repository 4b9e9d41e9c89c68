"""Vehicles as other systems describe them: uuv_simulator, Gazebo, a list of derivatives."""

# numbers of the rexrov description of uuv_simulator, after Berg 2012
REXROV_ADDED = """779.79 -6.8773 -103.32 8.5426 -165.54 -7.8033
  -6.8773 1222 51.29 409.44 -5.8488 62.726  -103.32 51.29 3659.9 6.1112 -386.42 10.774
  8.5426 409.44 6.1112 534.9 -10.027 21.019  -165.54 -5.8488 -386.42 -10.027 842.69 -1.1162
  -7.8033 62.726 10.775 21.019 -1.1162 224.32"""
REXROV = f"""
mass: 1862.87
inertial: {{ixx: 525.39, iyy: 794.2, izz: 691.23, ixy: 1.44, ixz: 33.41, iyz: 2.6}}
cog: [0, 0, 0]
cob: [0, 0, 0.3]
volume: 1.83826
density: 1028.0
hydrodynamic_model:
  type: fossen
  added_mass: {' '.join(REXROV_ADDED.split())}
  linear_damping: [-74.82, -69.48, -728.4, -268.8, -309.77, -105]
  quadratic_damping: [-748.22, -992.53, -1821.01, -672, -774.44, -523.27]
"""
URDF = f"""<robot name="rexrov">
  <link name="rexrov/base_link"><inertial><mass value="1862.87"/><origin xyz="0 0 0"/>
    <inertia ixx="525.39" ixy="1.44" ixz="33.41" iyy="794.20" iyz="2.6" izz="691.23"/>
  </inertial></link>
  <gazebo><plugin name="w" filename="libuuv_underwater_object_ros_plugin.so">
    <fluid_density>1028.0</fluid_density>
    <link name="rexrov/base_link"><neutrally_buoyant>0</neutrally_buoyant><volume>1.83826</volume>
      <box><width>1.5</width><length>2.6</length><height>1.6</height></box>
      <center_of_buoyancy>0.0 0.0 0.3</center_of_buoyancy>
      <hydrodynamic_model><type>fossen</type><added_mass>{REXROV_ADDED}</added_mass>
        <linear_damping>-74.82 -69.48 -728.4 -268.8 -309.77 -105</linear_damping>
        <quadratic_damping>-748.22 -992.53 -1821.01 -672 -774.44 -523.27</quadratic_damping>
      </hydrodynamic_model></link></plugin></gazebo></robot>"""
# Wu 2018: the origin is the centre of buoyancy, the tensor is about it
BLUEROV2 = r"""
m = 11.5; W = 112.8; B = 114.8;   % N
Ix = 0.16; Iy = 0.16; Iz = 0.16; zG = 0.02
Xudot = -5.5, Yvdot = -12.7, Z_{\dot w} = -14.57
Kpdot = -0.12; Mqdot = -0.12; Nrdot = -0.12;
X_u = -4.03; Yv = -6.22; Zw = -5.18; Kp = -0.07; Mq = -0.07; Nr = -0.07
Xuu = -18.18; Y_{v|v|} = -21.66; Z_{w|w|} = -36.99;  # quadratic
Kp|p| = -1.55; Mq|q| = -1.55; Nr|r| = -1.55
"""
# Prestero 2001, appendix C: derivatives by u are combined, with what the added mass adds to them
REMUS_LIFT = """
Yuv = -28.6; Yur = 5.22; Zuw = -28.6; Zuq = -5.22; Muw = 24; Muq = -2; Nuv = -24; Nur = -2
Yuudr = 9.64; Nuudr = -6.15; Zuuds = -9.64; Muuds = -6.15
"""
REMUS = """
W = 299; B = 306; rho = 1030; g = 9.81; Ix = 0.177; Iy = 3.45; Iz = 3.45; zG = 0.0196
Xudot = -0.93; Yvdot = -35.5; Yrdot = 1.93; Zwdot = -35.5; Zqdot = -1.93; Kpdot = -0.0704
Mwdot = -1.93; Mqdot = -4.88; Nvdot = 1.93; Nrdot = -4.88
Xu|u| = -1.62; Yv|v| = -1310; Yr|r| = 0.632; Zw|w| = -131; Zq|q| = -0.632; Kp|p| = -0.13
Mw|w| = 3.18; Mq|q| = -188; Nv|v| = -3.18; Nr|r| = -94
"""
# a link in FLU: nose heavy, below its buoyancy, with a product of inertia
SDF = """<sdf version="1.9"><world name="w"><gravity>0 0 -9.81</gravity>
  <plugin filename="gz-sim-buoyancy-system" name="gz::sim::systems::Buoyancy">
    <uniform_fluid_density>1000</uniform_fluid_density></plugin>
  <model name="made"><link name="base_link">
    <inertial><pose>0.01 0.02 -0.03 0 0 0</pose><mass>10</mass>
      <inertia><ixx>0.4</ixx><ixy>0.01</ixy><ixz>0.02</ixz><iyy>0.5</iyy><iyz>0.03</iyz><izz>0.6</izz>
      </inertia>{fluid}</inertial>
    <collision name="hull"><pose>0 0 0.05 0 0 0</pose>
      <geometry><box><size>0.2 0.2 0.25</size></box></geometry></collision></link>
    <plugin filename="gz-sim-hydrodynamics-system" name="gz::sim::systems::Hydrodynamics">
      <link_name>base_link</link_name>{added}
      <xU>-4</xU><yV>-6</yV><yR>-1</yR><zW>-5</zW><xUabsU>-18</xUabsU><nR>-3</nR>
      <nRabsR>-2</nRabsR>{more}
    </plugin></model></world></sdf>"""
ADDED = ''.join(f'<{tag}>{value}</{tag}>' for tag, value in {
    'xDotU': -5, 'yDotV': -12, 'zDotW': -14, 'kDotP': -1, 'mDotQ': -2, 'nDotR': -3,
    'xDotQ': -0.5, 'mDotU': -0.5, 'xDotV': -0.25, 'yDotU': -0.25}.items())  # fmt: skip


def sdf(added=ADDED, fluid='', more=''):
    return SDF.format(added=added, fluid=fluid, more=more)
