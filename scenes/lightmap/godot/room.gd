## A room with its lightmap, and a sphere lit by a probe. Run the project in this folder, after
##     halflight bake ../room.toml --lightmap all --size 256x192 --unit white -o map.pfm
##     halflight bake ../room.toml --probes 6x6x6 -o probes.json
## and with ../room.obj copied beside this script. The file of --directional=godot is directional.pfm.
extends Node3D

# Reflectances of room.mtl, linear.
const COLOURS := {"white": Color(0.7, 0.7, 0.7), "red": Color(0.6, 0.06, 0.05),
	"green": Color(0.12, 0.45, 0.1), "lamp": Color(0, 0, 0)}
const LAMP := Color(6, 5.4, 4.5)
const SPHERE := Vector3(0.5, 0.45, 0.25)

# Irradiance / pi by coefficients of radiance: 1, y, z, x, xy, yz, 3z^2 - 1, xz, x^2 - y^2.
const PROBE_SHADER := """shader_type spatial;
render_mode unshaded;
uniform vec3 coefficients[9];
uniform vec3 reflectance;
varying vec3 n;
void vertex() { n = normalize(MODEL_NORMAL_MATRIX * NORMAL); }
void fragment() {
	vec3 m = normalize(n);
	vec3 light = 0.282095 * coefficients[0]
		+ 0.488603 * (2.0 / 3.0) * (m.y * coefficients[1] + m.z * coefficients[2] + m.x * coefficients[3])
		+ 0.25 * (1.092548 * (m.x * m.y * coefficients[4] + m.y * m.z * coefficients[5] + m.x * m.z * coefficients[7])
		+ 0.315392 * (3.0 * m.z * m.z - 1.0) * coefficients[6]
		+ 0.546274 * (m.x * m.x - m.y * m.y) * coefficients[8]);
	light = max(reflectance * light, vec3(0.0));
	// The Compatibility renderer takes colours of shaders to be encoded.
	if (OUTPUT_IS_SRGB) {
		light = mix(12.92 * light, 1.055 * pow(light, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, light));
	}
	ALBEDO = light;
}"""


func _ready() -> void:
	var room := MeshInstance3D.new()
	room.name = "Mesh"
	room.mesh = read_mesh("res://room.obj")
	room.gi_mode = GeometryInstance3D.GI_MODE_STATIC
	add_child(room)

	# One texture, which all triangles of the mesh share: of one layer, or of four if the map is directional.
	var is_directional := FileAccess.file_exists("res://directional.pfm")
	var map := read_pfm("res://directional.pfm" if is_directional else "res://map.pfm")
	map.convert(Image.FORMAT_RGBAH)
	var count := 4 if is_directional else 1
	var size := Vector2i(map.get_width(), map.get_height() / count)
	var images: Array[Image] = []
	for layer in count:
		images.append(map.get_region(Rect2i(Vector2i(0, layer * size.y), size)))
	var texture := Texture2DArray.new()
	texture.create_from_images(images)
	var light := LightmapGI.new()
	add_child(light)
	var data := LightmapGIData.new()
	data.set_lightmap_textures([texture])
	data.set_uses_spherical_harmonics(is_directional)
	data.add_user(light.get_path_to(room), Rect2(0, 0, 1, 1), 0, -1)
	# Outside of its bounds a lightmap is not drawn.
	RenderingServer.lightmap_set_probe_bounds(data.get_rid(), room.get_aabb().grow(1.0))
	light.light_data = data

	add_child(sphere())
	$Camera3D.look_at_from_position(Vector3(0, 1, 3.6), Vector3(0, 0.95, 0))


## A map of three floats a texel. Godot without threads, as in browsers, reads no EXR.
func read_pfm(path: String) -> Image:
	var file := FileAccess.open(path, FileAccess.READ)
	file.get_line()
	var size := file.get_line().split(" ")
	file.get_line()
	var width := size[0].to_int()
	var height := size[1].to_int()
	var image := Image.create_from_data(width, height, false, Image.FORMAT_RGBF, file.get_buffer(12 * width * height))
	image.flip_y()
	return image


## The surfaces of an OBJ file, one for each material. v goes down here, and fronts are clockwise.
func read_mesh(path: String) -> ArrayMesh:
	var positions: Array[Vector3] = []
	var coordinates: Array[Vector2] = []
	var surfaces := {}
	var current: SurfaceTool
	for line in FileAccess.get_file_as_string(path).split("\n"):
		var words := line.split(" ", false)
		if words.is_empty():
			continue
		match words[0]:
			"v":
				positions.append(Vector3(words[1].to_float(), words[2].to_float(), words[3].to_float()))
			"vt":
				coordinates.append(Vector2(words[1].to_float(), 1.0 - words[2].to_float()))
			"usemtl":
				if not surfaces.has(words[1]):
					surfaces[words[1]] = SurfaceTool.new()
					surfaces[words[1]].begin(Mesh.PRIMITIVE_TRIANGLES)
					surfaces[words[1]].set_smooth_group(-1)
				current = surfaces[words[1]]
			"f":
				for i in range(2, words.size() - 1):
					for word in [words[1], words[i + 1], words[i]]:
						var corner: PackedStringArray = word.split("/")
						current.set_uv2(coordinates[corner[1].to_int() - 1])
						current.add_vertex(positions[corner[0].to_int() - 1])
	var mesh := ArrayMesh.new()
	for material in surfaces:
		surfaces[material].generate_normals()
		surfaces[material].commit(mesh)
		mesh.surface_set_material(mesh.get_surface_count() - 1, diffuse(material))
	return mesh


func diffuse(material: String) -> StandardMaterial3D:
	var made := StandardMaterial3D.new()
	made.albedo_color = COLOURS[material].linear_to_srgb()
	made.metallic_specular = 0.0
	made.roughness = 1.0
	if material == "lamp":
		made.emission_enabled = true
		made.emission = Color(LAMP / LAMP.r).linear_to_srgb()
		made.emission_energy_multiplier = LAMP.r
	return made


## A sphere lit by the nearest probe of the grid.
func sphere() -> MeshInstance3D:
	var grid: Dictionary = JSON.parse_string(FileAccess.get_file_as_string("res://probes.json"))
	var cell := 0
	for axis in [2, 1, 0]:
		var size: int = grid.size[axis]
		var part: float = (SPHERE[axis] - grid.box.min[axis]) / (grid.box.max[axis] - grid.box.min[axis])
		cell = cell * size + clampi(floori(part * size), 0, size - 1)
	var coefficients := PackedVector3Array()
	for rgb in grid.coefficients[cell]:
		coefficients.append(Vector3(rgb[0], rgb[1], rgb[2]))
	var material := ShaderMaterial.new()
	material.shader = Shader.new()
	material.shader.code = PROBE_SHADER
	material.set_shader_parameter("coefficients", coefficients)
	material.set_shader_parameter("reflectance", Vector3(0.7, 0.7, 0.7))
	var made := MeshInstance3D.new()
	made.mesh = SphereMesh.new()
	made.mesh.radius = 0.3
	made.mesh.height = 0.6
	made.material_override = material
	made.position = SPHERE
	return made
