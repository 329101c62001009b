# An organ that palpate-igtl computes, in a scene of Godot 3: sends where a tool is, gets its force and the organ's surface, over OpenIGTLink.
# Everything here is in the frame of OpenIGTLink, RAS and millimetres. From the command line, for a run without a window:
#   --port 18944 --tool probe --points "x,y,z x,y,z ..."  moves the tool from point to point, prints the force and the surface, and quits
extends MeshInstance

const HEADER := 58
const POLYNOMIAL := 0x42F0E1EBA9EA3693 # of CRC-64, ECMA-182

export var port := 18944
export var tool_name := "probe"
var tool_position := Vector3.ZERO
var force := Vector3.ZERO # N, of the organ on the tool
var moved := 0.0 # mm, by which the surface is displaced at most

var _server := StreamPeerTCP.new()
var _received := PoolByteArray()
var _table := []
var _path := []
var _second := 0.0

func _ready() -> void:
	var words := OS.get_cmdline_args()
	for i in range(words.size() - 1):
		match words[i]:
			"--port": port = int(words[i + 1])
			"--tool": tool_name = words[i + 1]
			"--points":
				for point in words[i + 1].split(" "):
					var numbers = point.split_floats(",")
					_path.append(Vector3(numbers[0], numbers[1], numbers[2]))
	for first in range(256):
		var crc: int = first << 56
		for bit in range(8):
			crc = (crc << 1) ^ POLYNOMIAL if crc < 0 else crc << 1
		_table.append(crc)
	_server.big_endian = true
	if _server.connect_to_host("127.0.0.1", port) != OK:
		push_error("no palpate-igtl on port %d" % port)

func _process(delta: float) -> void:
	if _server.get_status() != StreamPeerTCP.STATUS_CONNECTED:
		return
	if not _path.empty():
		_follow_path(delta)
	_send_tool()
	var waiting := _server.get_available_bytes()
	if waiting > 0:
		_received.append_array(_server.get_data(waiting)[1])
	while _received.size() >= HEADER and _received.size() >= HEADER + _number(_received, 42, 8):
		var end := HEADER + _number(_received, 42, 8)
		_take(_received.subarray(2, 13).get_string_from_ascii(), _received.subarray(14, 33).get_string_from_ascii(),
			_received.subarray(HEADER, end - 1) if end > HEADER else PoolByteArray())
		_received = _received.subarray(end, _received.size() - 1) if end < _received.size() else PoolByteArray()

# A tenth of a second from point to point; half a second at the last one, so that the newest force and surface arrive. A frame that
# came late does not make the tool jump: one that appears inside the organ touches nothing.
func _follow_path(delta: float) -> void:
	if mesh:
		_second += min(delta, 0.005)
	var at := min(_second / 0.1, _path.size() - 1)
	var before := int(at)
	tool_position = _path[before].linear_interpolate(_path[min(before + 1, _path.size() - 1)], at - before)
	if _second > 0.1 * (_path.size() - 1) + 0.5:
		print("force %.6f %.6f %.6f N, surface moved %.6f mm, %d vertices" % [
			force.x, force.y, force.z, moved, mesh.surface_get_array_len(0) if mesh else 0])
		get_tree().quit()

func _send_tool() -> void:
	var body := StreamPeerBuffer.new()
	body.big_endian = true
	for number in [1, 0, 0, 0, 1, 0, 0, 0, 1, tool_position.x, tool_position.y, tool_position.z]:
		body.put_float(number)
	var crc := 0
	for byte in body.data_array:
		crc = _table[((crc >> 56) & 255) ^ byte] ^ (crc << 8)
	_server.put_u16(1)
	_put_name("TRANSFORM", 12)
	_put_name(tool_name, 20)
	_server.put_u64(0) # no time
	_server.put_u64(body.data_array.size())
	_server.put_u64(crc)
	_server.put_data(body.data_array)

func _put_name(text: String, bytes: int) -> void:
	var name := text.to_ascii()
	name.resize(bytes)
	for i in range(text.length(), bytes):
		name[i] = 0
	_server.put_data(name)

func _take(type: String, device: String, body: PoolByteArray) -> void:
	if type == "SENSOR" and device == tool_name:
		force = Vector3(_double(body, 10), _double(body, 18), _double(body, 26))
	elif type == "POLYDATA":
		_draw_surface(body)

# Points, then polygons, then the attribute "displacement", as the standard has them.
func _draw_surface(body: PoolByteArray) -> void:
	var stream := StreamPeerBuffer.new()
	stream.big_endian = true
	stream.data_array = body
	var counts := []
	for i in range(10):
		counts.append(stream.get_u32()) # points; number and bytes of vertices, lines, polygons, strips; attributes
	var points := PoolVector3Array()
	for i in range(counts[0]):
		var x := stream.get_float()
		var y := stream.get_float()
		points.append(Vector3(x, y, stream.get_float()))
	stream.seek(stream.get_position() + counts[2] + counts[4])
	var triangles := PoolIntArray()
	for i in range(counts[5]):
		stream.get_u32() # 3
		for corner in range(3):
			triangles.append(stream.get_u32())
	# Godot's front faces are clockwise.
	for i in range(0, triangles.size(), 3):
		var second := triangles[i + 1]
		triangles[i + 1] = triangles[i + 2]
		triangles[i + 2] = second
	stream.seek(body.size() - 12 * counts[0]) # three floats of each point stand at the end
	moved = 0.0
	for i in range(counts[0]):
		var x := stream.get_float()
		var y := stream.get_float()
		moved = max(moved, Vector3(x, y, stream.get_float()).length())
	var arrays := []
	arrays.resize(ArrayMesh.ARRAY_MAX)
	arrays[ArrayMesh.ARRAY_VERTEX] = points
	arrays[ArrayMesh.ARRAY_INDEX] = triangles
	if not mesh:
		mesh = ArrayMesh.new()
	elif mesh.get_surface_count() > 0:
		mesh.surface_remove(0)
	mesh.add_surface_from_arrays(Mesh.PRIMITIVE_TRIANGLES, arrays)

func _number(bytes: PoolByteArray, at: int, size: int) -> int:
	var number := 0
	for i in range(at, at + size):
		number = (number << 8) | bytes[i]
	return number

func _double(bytes: PoolByteArray, at: int) -> float:
	var stream := StreamPeerBuffer.new()
	stream.big_endian = true
	stream.data_array = bytes.subarray(at, at + 7)
	return stream.get_double()
