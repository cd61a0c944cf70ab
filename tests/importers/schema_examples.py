"""Files with all elements and attributes that the importers take from URDF, SDF and MJCF. Each of them changes the scene."""

INERTIA = '<inertia ixx="2" iyy="3" izz="4" ixy="0.1" ixz="0.2" iyz="0.3"/>'
INERTIAL = f'<inertial><origin xyz="0 0 -0.5" rpy="0.1 0 0"/><mass value="1"/>{INERTIA}</inertial>'
PLAIN = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial>'
URDF = [f"""<robot name="arm">
<link name="base"/>
<link name="a">{INERTIAL}
 <visual><origin xyz="0 0 1" rpy="0 1 0"/><geometry><box size="1 2 3"/></geometry></visual>
 <visual><geometry><cylinder radius="1" length="2"/></geometry></visual>
 <visual><geometry><sphere radius="1"/></geometry></visual>
 <visual><geometry><mesh filename="part.obj" scale="2 2 2"/></geometry></visual></link>
<link name="b">{PLAIN}</link>
<joint name="j" type="revolute"><origin xyz="0 0 1" rpy="0 0 1"/><parent link="base"/><child link="a"/><axis xyz="0 1 0"/>
 <dynamics damping="0.1" friction="0.2"/><limit lower="-1" upper="1"/></joint>
<joint name="k" type="continuous"><parent link="a"/><child link="b"/><mimic joint="j" multiplier="2" offset="0.1"/></joint>
</robot>"""]

MOMENTS = "<ixx>2</ixx><iyy>3</iyy><izz>4</izz><ixy>0.1</ixy><ixz>0.2</ixz><iyz>0.3</iyz>"
DYNAMICS = """<dynamics><damping>1</damping><friction>2</friction><spring_reference>0.3</spring_reference><spring_stiffness>4
</spring_stiffness></dynamics><limit><lower>-1</lower><upper>1</upper></limit>"""
BOX = "<visual><geometry><box><size>1 2 3</size></box></geometry></visual>"
SDF = [f"""<sdf version="1.4"><world name="w"><gravity>0 0 -3</gravity>
<frame name="up" attached_to="arm"><pose>0 0 1 0 0 0</pose></frame>
<include><uri>part</uri><name>other</name><pose>1 0 0 0 0 0</pose><static>1</static><placement_frame>foot</placement_frame>
</include>
<include><uri>part</uri><name>third</name><pose>1 0 0 0 0 0</pose><placement_frame>foot</placement_frame></include>
<joint name="g" type="revolute"><parent>world</parent><child>up</child><axis><xyz>0 1 0</xyz></axis></joint>
<joint name="gg" type="revolute"><parent>world</parent><child>third::p</child><axis><xyz>0 1 0</xyz></axis></joint>
<model name="still"><static>true</static><link name="l"/></model>
<model name="arm" canonical_link="b" placement_frame="b"><pose>0 1 0 0 0 90</pose>
<include><uri>part</uri><name>inner</name><placement_frame>foot</placement_frame><pose>1 0 0 0 0 0</pose></include>
<include><uri>part</uri><name>rest</name><static>1</static></include>
<frame name="f" attached_to="b"><pose degrees="true">0 1 0 0 0 90</pose></frame>
<link name="a"><gravity>0</gravity><pose relative_to="f">0 0 1 0 0 0</pose>
 <inertial><pose degrees="true">0 0 1 0 90 0</pose><mass>2</mass><inertia>{MOMENTS}</inertia></inertial></link>
<link name="b"><pose rotation_format="quat_xyzw">0 0 3 1 0 0 0</pose>
 <inertial><pose rotation_format="quat_xyzw">0 0 3 1 0 0 0</pose><inertia><ixx>1</ixx><iyy>2</iyy><izz>3</izz></inertia>
</inertial></link>
<link name="c"><pose frame="f">0 0 5 0 0 0</pose></link><link name="d"/>
<joint name="j" type="revolute"><pose>0 0 1 0 0 0</pose><parent>world</parent><child>a</child>
 <axis><xyz expressed_in="f">0 1 1</xyz>{DYNAMICS}</axis><physics><ode/></physics></joint>
<joint name="k" type="revolute"><parent>a</parent><child>inner::p</child><axis><xyz>0 1 0</xyz>
 <mimic joint="j"><multiplier>2</multiplier><offset>0.1</offset><reference>0.2</reference></mimic></axis></joint>
<joint name="u" type="universal"><parent>b</parent><child>c</child><axis><xyz>1 0 0</xyz></axis><axis2><xyz>0 1
0</xyz>{DYNAMICS}</axis2></joint>
<joint name="s" type="screw"><parent>c</parent><child>d</child><axis/><screw_thread_pitch>2</screw_thread_pitch></joint>
</model></world></sdf>""",
"""<sdf version="1.6"><model name="m"><link name="a"/><link name="b"/><link name="c"/><model name="n"><link name="e"/></model>
<joint name="j" type="screw"><pose>0 0 0 0 1 0</pose><parent>a</parent><child>b</child><thread_pitch>3</thread_pitch><axis>
<xyz>1 0 0</xyz>
 <use_parent_model_frame>1</use_parent_model_frame></axis></joint>
<joint name="r" type="revolute2"><pose>0 0 0 0 1 0</pose><parent>b</parent><child>c</child><axis><limit><lower>-1</lower>
<upper>1</upper>
 </limit></axis><axis2><xyz>1 0 0</xyz><use_parent_model_frame>1</use_parent_model_frame><limit><lower>-1</lower>
<upper>1</upper></limit></axis2></joint>
<joint name="h" type="universal"><pose>0 0 0 0 1 0</pose><parent>c</parent><child>n::e</child><axis><xyz>1 0 0</xyz></axis>
 <axis2><xyz expressed_in="b">0 1 1</xyz></axis2></joint></model></sdf>""",
*(f"""<sdf version="1.8"><model name="m"><link name="a"><visual name="v"><pose>0 0 1 1 0 0</pose><geometry>{solid}</geometry>
</visual></link>
</model></sdf>""" for solid in (
    "<box><size>1 2 3</size></box>", "<cylinder><length>1</length><radius>2</radius></cylinder>",
    "<sphere><radius>1</radius></sphere>",
    "<capsule><length>2</length><radius>1</radius></capsule>", "<ellipsoid><radii>1 2 3</radii></ellipsoid>",
    "<mesh><uri>part.obj</uri><scale>2 2 2</scale></mesh>",
))]

BODY = '<inertial pos="0 0 1" mass="2" diaginertia="2 3 4" quat="1 1 0 0"/>'
TWO = "".join(
    f'<body name="{n}" pos="0 0 1"><joint name="{n}j" axis="0 1 0"/>{BODY}<site name="{n}s" pos="0 0 2" quat="1 1 0 0"/></body>'
    for n in "ab"
)
TURNS = ('quat="1 1 0 0"', 'axisangle="1 0 0 1"', 'euler="1 2 3"', 'xyaxes="0 1 0 1 0 0"', 'zaxis="0 1 1"')
LINE = 'type="capsule" size="1" fromto="0 0 0 0 1 1"'
TRANSMITTED = (
    "general", "motor", "position", "velocity", "intvelocity", "pid", "damper", "cylinder", "muscle", "dcmotor", "plugin",
)  # fmt: skip
FORCED = ("armature", "frictionloss", "stiffness", "damping")
FLAGS = ("constraint", "damper", "equality", "frictionloss", "gravity", "limit", "spring", "passive")


def _mjcf(world: str, before: str = "", after: str = "") -> str:
    return f'<mujoco model="example">{before}<worldbody>{world}</worldbody>{after}</mujoco>'


def _body(inside: str) -> str:
    return _mjcf(f'<body name="a"><joint/>{inside}</body>')


def _default(tag: str, more: str) -> str:
    return f'<default><default class="c"><{tag} {more}/></default></default>'


def _posed(tag: str, start: str, end: str) -> str:
    '''Elements with each way to give a pose, in a body that moves.'''
    return _body("".join(f'<{tag} name="{tag}{k}" pos="{k} 0 1" {way}{start}{end}' for k, way in enumerate(TURNS)))


def _flag(name: str) -> str:
    joint = '<joint stiffness="1" springref="1" damping="1" frictionloss="1" range="0 1"/>'
    coupled = '<equality><joint joint1="aj" joint2="bj"/></equality>'
    return _mjcf(f"<body>{joint}{BODY}</body>{TWO}", f'<option><flag {name}="disable"/></option>', coupled)


BOX = '<geom type="box" size="1 2 3"/>'
SIMPLE = '<inertial pos="0 0 1" mass="1" diaginertia="1 1 9"/>'
FREE = '<inertial pos="0 0 1" mass="1" diaginertia="1 2 3"/>'
ROPE = '<site site="as"/><site site="bs"/></spatial>'
MJCF = [
    _mjcf(f'''<body name="a" pos="0 0 1" childclass="inner" gravcomp="0.5">
    <joint name="h" axis="0 1 0" pos="0 0 0.1" ref="0.1" range="-1 1" limited="true" stiffness="2" springref="0.3" armature="0.1"
    damping="0.2" frictionloss="0.3"/>{BODY}
    <body name="b"><joint name="g" type="slide" springdamper="1 1" class="all" range="0 1"/><geom size="0.1"/>
    <geom size="0.1" class="all"/><frame name="f" childclass="all"><geom size="1"/></frame></body></body>
    <body name="c"><freejoint name="free"/>{BODY}</body>''', '''<default class="all"><default class="inner"><joint damping="0.7"
    armature="2"/><geom density="9"/></default><geom density="3"/><joint armature="1"/></default><option gravity="0 0 -3"/>
    <compiler angle="radian" autolimits="false" boundmass="3" boundinertia="30" settotalmass="20"/>'''),
    _mjcf('''<body euler="10 20 30"><joint/><inertial pos="0 0 1" mass="1" diaginertia="1 1 9"/><geom type="mesh" mesh="m"/>
    <geom type="mesh" mesh="part"/><geom type="mesh" mesh="v" mass="3"/><geom type="box" size="1 2 3" group="4"/>
    <geom type="capsule" size="0.1" fromto="0 0 0 0 1 1" density="3"/></body>''', '''<compiler balanceinertia="true"
    strippath="true" inertiafromgeom="true" inertiagrouprange="0 3" eulerseq="zyx" meshdir="meshes"/>
    <default><default class="odd"><mesh scale="3 3 3"/></default></default><asset>
    <mesh name="m" file="away/part.obj" scale="2 2 2" refpos="1 0 0" refquat="1 1 0 0"/>
    <mesh class="odd" file="part.obj"/>
    <mesh name="v" vertex="0 0 0 1 0 0 0 1 0 0 0 1" face="0 2 1 0 1 3 0 3 2" inertia="convex"/></asset>'''),
    _body('<inertial mass="1" pos="0 0 0" fullinertia="1 2 2.5 0 0 0.1"/>'),
    _mjcf(f"<body><joint/>{SIMPLE}</body>", '<compiler balanceinertia="true"/>'),
    _mjcf('<body><joint/><geom type="mesh" mesh="part"/></body>',
          '<compiler assetdir="meshes"/><asset><mesh file="part.obj"/></asset>'),
    _posed("geom", ' type="box" size="1 2 3"', "/>"), _posed("body", ">", f"{BODY}</body>"), _posed("frame", ">", f"{BOX}</frame>"),
    *(_body(f'<inertial pos="0 0 0" mass="1" diaginertia="1 2 3" {way}/>') for way in TURNS),
    *(_mjcf(f'{TWO}<site name="g" {way}/>', "", '<equality><weld name="w" site1="as" site2="g"/></equality>')
      for way in (*TURNS, LINE)),
    _mjcf(f'''<frame pos="0 0 1"><body><joint/>{BOX}</body><frame><body><frame pos="1 0 0"><joint/><frame pos="0 1 0">{BOX}
    <site name="g"/></frame></frame></body><body><frame><freejoint/><geom size="1"/></frame></body></frame></frame>
    <site name="h"/>''',
    "", '<equality><connect site1="g" site2="h"/></equality>'),
    _mjcf(f'{TWO}<site name="g" class="c"/>',
    '<default><default class="c"><equality active="false"/><site pos="0 1 0"/></default></default>',
    f'''<equality><joint name="q" joint1="aj" joint2="bj" polycoef="0.1 2" class="c" active="true"/>
    <connect name="p" body1="a" body2="b" anchor="0 0 1" class="c" active="true"/><connect name="p2" site1="as" site2="g"/>
    <weld name="w" body1="a" body2="b" relpose="0 1 0 1 1 0 0" class="c" active="true"/><weld site1="as" site2="bs"/>
    <weld class="c" body1="a"/><connect class="c" body1="a" anchor="0 0 1"/><joint class="c" joint1="bj" joint2="aj"/>
    {"".join(f'<{kind} class="c"/><{kind} active="false"/>' for kind in ("tendon", "flex", "flexstrain"))}</equality>'''),
    _mjcf(TWO, _default("tendon", 'damping="0.3" stiffness="2" springlength="0.5"'), f'''<tendon>
    <spatial name="one" class="c">{ROPE}<spatial name="two" stiffness="2" damping="1" springlength="1">{ROPE}</tendon>'''),
    *(_mjcf(TWO, _default("tendon", f'{force}="1"'), f'<tendon><{kind} class="c"/></tendon>')
      for kind, force in (("fixed", "armature"), ("spatial", "frictionloss"))),
    *(_mjcf(TWO, "", f'<tendon><{kind} name="t" {force}="1"/></tendon>') for kind in ("fixed", "spatial") for force in FORCED),
    *(_mjcf(f'<body><joint name="j"/>{SIMPLE}</body>', _default(kind, 'armature="0.2" damping="0.1" gear="2"'),
            f'<actuator><{kind} joint="j" class="c"/><{kind} jointinparent="j" armature="0.4" gear="3" damping="1"/></actuator>')
      for kind in TRANSMITTED),
    _mjcf(f'<body name="a"><freejoint name="f" align="true"/>{FREE}</body>', "",
          '<keyframe><key name="k" qpos="0 0 1 1 0 0 0" qvel="1 0 0 0 0 0"/></keyframe>'),
    _mjcf(f"<body><freejoint/>{FREE}</body>", '<compiler alignfree="true"/>', '<keyframe><key qpos="0 0 1 1 0 0 0"/></keyframe>'),
    *map(_flag, FLAGS),
]


def _with(more: str = "", before: str = "", after: str = "") -> str:
    return _mjcf(f"<body><joint name='j'/><geom size='1' name='g'/>{more}</body>", before, after)


def _model(link: str = "", more: str = "") -> str:
    return f"<sdf version='1.11'><model name='m'><link name='a'>{link}</link><link name='b'/><link name='c'/>{more}</model></sdf>"


MESH = '<geom type="mesh" mesh="m"/>'
INCLUDE = "\n<include merge='true'><!--!--><uri>part</uri></include>\n"
SECTION = "<{0}>\n{1}<!--!-->\n</{0}>".format
REFUSED = {"SDF": {
    "model/include@merge": _model(more=INCLUDE),
    "world/include@merge": f"<sdf version='1.11'><world>{INCLUDE}</world></sdf>",
    "inertial@auto": _model("\n<inertial auto='true'><!--!--></inertial>\n"),
    "inertial/fluid_added_mass": _model("\n<inertial><!--!--><fluid_added_mass><xx>1</xx></fluid_added_mass></inertial>\n"),
    **{f"inertial/pose@{key}": _model(f"<inertial>\n<pose {key}='b'>1 0 0 0 0 0<!--!--></pose>\n</inertial>")
       for key in ("frame", "relative_to")},
    "joint/axis2+mimic": _model(more='''<joint name='u' type='revolute'><parent>a</parent><child>b</child><axis/></joint>
<joint name='v' type='universal'><!--!--><parent>b</parent><child>c</child><axis/>
<axis2><xyz>0 1 0</xyz><mimic joint='u'/></axis2></joint>'''),
}, "MJCF": {
    "mujoco/compiler@coordinate": _with(before="\n<compiler coordinate='global'/><!--!-->\n"),
    "mujoco/deformable/flex": _with(after=SECTION("deformable", "<flex name='f'/>")),
    "mujoco/tendon/spatial@springyield": _with(after=SECTION("tendon", "<spatial stiffness='1' springyield='1'/>")),
    "mujoco/tendon/fixed@springyield mujoco/tendon/fixed/joint": _with(
        after=SECTION("tendon", "<fixed stiffness='1' springyield='1'><joint joint='j'/></fixed>")),
    "default/tendon@springyield mujoco/tendon/spatial/geom mujoco/tendon/spatial/pulley": _with(
        before="<default><tendon springyield='1'/></default>",
        after=SECTION("tendon", "<spatial stiffness='1'><geom geom='g'/><pulley divisor='2'/></spatial>")),
    **{f"mujoco/equality/{kind}": _with(after=SECTION("equality", f"<{kind}/>")) for kind in ("tendon", "flex", "flexstrain")},
    **{item: _with(f"\n<{item.rpartition('/')[2]}/><!--!-->\n")
       for item in ("body/plugin", "attach", "replicate", "composite", "flexcomp")},
    "joint@springyield": _mjcf("<body>\n<joint stiffness='1' springyield='0.1'/><!--!-->\n<geom size='1'/></body>"),
    "geom@fitscale": _with(
        "\n<geom type='box' mesh='m' fitscale='1'/><!--!-->\n", "<asset><mesh name='m' file='part.obj'/></asset>"),
    "geom@shellinertia": _with("\n<geom size='1' shellinertia='true'/><!--!-->\n"),
    "geom/plugin": _with("\n<geom type='sdf' size='1'><!--!--><plugin plugin='p'/></geom>\n"),
    "mesh@builtin mesh@params": _with(MESH, SECTION("asset", "<mesh name='m' builtin='cone' params='1 2'/>")),
    "mesh/plugin": _with(MESH, SECTION("asset", "<mesh name='m'><plugin plugin='p'/></mesh>")),
}}
