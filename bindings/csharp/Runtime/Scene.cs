using System;
using System.Collections.Generic;
using System.Runtime.InteropServices;
using System.Threading;
using Palpate.Native;
using static Palpate.Native.Api;

namespace Palpate {
  sealed unsafe class SceneHandle : Handle {
    internal BundleHandle Bundle;

    protected override bool ReleaseHandle() {
      palpate_scene_destroy((palpate_scene*)handle);
      Bundle.Unlock();
      return true;
    }
  }

  /// <summary>
  /// One organ under one set of effects. One thread may touch while another shapes; a second thread in the same half gets an
  /// InvalidOperationException. A step allocates nothing.
  /// </summary>
  public sealed unsafe class Scene : IDisposable {
    readonly SceneHandle handle = new SceneHandle();
    readonly Memory tools;  // [PALPATE_MAX_TOOLS] palpate_tool, palpate_grasp, palpate_needle
    Memory points, grips;   // as many as the largest touch so far had
    int pointRoom, gripRoom, touches, shapes;

    public Bundle Bundle { get; }
    /// <summary>Nodes that Shape fills: the surface's, all under shape "volume", none under "off".</summary>
    public int ShapeNodeCount { get; }
    /// <summary>Vertices that Skin fills: those of renderMesh.</summary>
    public int SkinVertexCount { get; }
    internal ulong ContactsBytes { get; }

    /// <summary>
    /// renderMesh: a finer surface, drawn by Skin. fineSurface: a finer surface, closed, which tools meet. obstacles: at most 16 (collision "deformed").
    /// </summary>
    public Scene(Bundle bundle, Effects effects = null, Surface renderMesh = null, Surface fineSurface = null,
                 Obstacle[] obstacles = null) {
      Bundle = bundle ?? throw new ArgumentNullException(nameof(bundle));
      palpate_scene_def def = palpate_default_scene_def();
      using (var parts = new Memory(palpate_all_parts_bytes())) {
        palpate_add_all_parts(&def, parts.Pointer);
        effects?.Set(&def);
        fixed(float* drawn = renderMesh?.Positions, normals = renderMesh?.Normals, met = fineSurface?.Positions)
            fixed(int* triangles = fineSurface?.Triangles) {
          if (renderMesh != null) {
            SkinVertexCount = Rows(renderMesh.Positions, "renderMesh.Positions");
            if (renderMesh.Normals != null) Need(renderMesh.Normals, SkinVertexCount, "renderMesh.Normals");
            var part = (palpate_render_mesh*)PartOf(&def, "render_mesh");
            part->positions = drawn;
            part->normals = normals;
            part->vertex_count = SkinVertexCount;
          }
          if (fineSurface != null) {
            var part = (palpate_fine_surface*)PartOf(&def, "fine_surface");
            part->vertex_count = Rows(fineSurface.Positions, "fineSurface.Positions");
            part->triangle_count = Rows(fineSurface.Triangles, "fineSurface.Triangles");
            part->positions = met;
            part->triangles = triangles;
          }
          if (obstacles != null && obstacles.Length > 0)
            CreateWith(&def, obstacles);
          else
            Create(&def);
        }
      }
      palpate_bundle_info info = bundle.Info;
      ShapeNodeCount = def.shape == palpate_shape_model.OFF       ? 0
                       : def.shape == palpate_shape_model.SURFACE ? info.surface_node_count
                                                                  : info.node_count;
      ContactsBytes = palpate_contacts_bytes((palpate_scene*)handle.Pointer);
      tools = new Memory(
          (ulong)(PALPATE_MAX_TOOLS * (sizeof(palpate_tool) + sizeof(palpate_grasp) + sizeof(palpate_needle))));
    }

    // The arrays of their meshes stay where they are until the scene has copied them.
    void CreateWith(palpate_scene_def* def, Obstacle[] obstacles) {
      var pinned = new List<GCHandle>();
      try {
        using (var list = new Memory((ulong)(obstacles.Length * sizeof(palpate_obstacle)))) {
          for (int i = 0; i < obstacles.Length; ++i) {
            Obstacle from = obstacles[i];
            palpate_obstacle one = palpate_default_obstacle();
            one.kind = from.Kind;
            one.size[0] = from.SizeX;
            one.size[1] = from.SizeY;
            one.friction = from.Friction;
            one.depth = from.Depth;
            Store(from.Position, one.position);
            Store(from.Orientation, one.orientation);
            if (from.Mesh != null) {
              one.vertex_count = Rows(from.Mesh.Positions, "Obstacle.Mesh.Positions");
              one.triangle_count = Rows(from.Mesh.Triangles, "Obstacle.Mesh.Triangles");
              one.positions = (float*)Pin(from.Mesh.Positions, pinned);
              one.triangles = (int*)Pin(from.Mesh.Triangles, pinned);
            }
            ((palpate_obstacle*)list.Pointer)[i] = one;
          }
          var part = (palpate_obstacles_def*)PartOf(def, "obstacles.count");
          part->count = obstacles.Length;
          part->list = (palpate_obstacle*)list.Pointer;
          Create(def);
        }
      } finally {
        foreach (GCHandle each in pinned) each.Free();
      }
    }

    static void* Pin(Array array, List<GCHandle> pinned) {
      pinned.Add(GCHandle.Alloc(array, GCHandleType.Pinned));
      return (void*)pinned[pinned.Count - 1].AddrOfPinnedObject();
    }

    static void Store(Vector from, double* to) {
      to[0] = from.X;
      to[1] = from.Y;
      to[2] = from.Z;
    }

    static void Store(Turn from, double* to) {
      to[0] = from.W;
      to[1] = from.X;
      to[2] = from.Y;
      to[3] = from.Z;
    }

    void Create(palpate_scene_def* def) {
      palpate_scene* scene = null;
      palpate_error error;
      palpate_status status = palpate_scene_create((palpate_bundle*)Bundle.Handle.Lock(), def, &scene, &error);
      if (status != palpate_status.OK) Bundle.Handle.Unlock();
      PalpateException.ThrowIfFailed(status, &error);
      handle.Bundle = Bundle.Handle;
      handle.Set(scene);
    }

    static palpate_part* PartOf(palpate_scene_def* def, string key) {
      palpate_effect* effect = Effects.Find(key)->effect;
      palpate_part* part = def->parts;
      while (part->effect != effect) part = part->next;
      return part;
    }

    /// <summary>For the functions of Palpate.Native.Api. Valid until Dispose.</summary>
    public palpate_scene* Pointer =>
        handle.IsClosed ? throw new ObjectDisposedException(nameof(Scene)) : (palpate_scene*)handle.Pointer;

    public Contacts MakeContacts() { return new Contacts(ContactsBytes); }

    /// <summary>The haptic half. dt: s since the last touch. Returns the step's flags; 0 is a step that kept all its tolerances.</summary>
    public palpate_step_flags Touch(Tool[] tools, double dt, Contacts contacts) {
      if (tools == null) throw new ArgumentNullException(nameof(tools));
      if (contacts == null) throw new ArgumentNullException(nameof(contacts));
      if (tools.Length > PALPATE_MAX_TOOLS)
        throw new ArgumentException("a scene has at most " + PALPATE_MAX_TOOLS + " tools, found " + tools.Length);
      if (contacts.Bytes < ContactsBytes)
        throw new ArgumentException("contacts: expected those of this scene's MakeContacts, found smaller ones");
      var scene = (palpate_scene*)Begin(ref touches, "Touch");
      bool locked = false;
      try {
        contacts.Lock(ref locked);
        return palpate_scene_touch(scene, Copy(tools), tools.Length, dt, contacts.At, contacts.Bytes);
      } finally {
        if (locked) contacts.Unlock();
        End(ref touches);
      }
    }

    /// <summary>Where one of the scene's obstacles is in the world from the next touch on.</summary>
    public void SetObstaclePose(int obstacle, Vector position, Turn orientation) {
      palpate_pose pose = palpate_default_pose();
      palpate_error error;
      Store(position, pose.position);
      Store(orientation, pose.orientation);
      var scene = (palpate_scene*)Begin(ref touches, "SetObstaclePose");
      try {
        PalpateException.ThrowIfFailed(palpate_scene_set_obstacle_pose(scene, obstacle, &pose, &error), &error);
      } finally {
        End(ref touches);
      }
    }

    public void SetObstaclePose(int obstacle, Vector position) => SetObstaclePose(obstacle, position, Turn.None);

    /// <summary>One of the scene's obstacles after the last touch.</summary>
    public ObstacleState StateOfObstacle(int obstacle) {
      var scene = (palpate_scene*)Begin(ref touches, "StateOfObstacle");
      try {
        palpate_obstacle_state* state = palpate_scene_obstacle_state(scene, obstacle);
        if (state == null) throw new ArgumentException("the scene has no obstacle " + obstacle);
        return new ObstacleState { Force = new Vector(state->force),
                                   Torque = new Vector(state->torque),
                                   Position = new Vector(state->position),
                                   Deepest = state->deepest,
                                   Nodes = state->nodes,
                                   Slips = state->slips };
      } finally {
        End(ref touches);
      }
    }

    /// <summary>
    /// Where blade 0 .. 3 is at the next touch: x, y, z of 2 to 16 points along its edge, m, in the world. It cuts what lies between there and where it
    /// was in the touch before. toughness: J/m^2, of tissue that holds the edge; above 0, direction says where the edge looks, of length 1.
    /// friction: Pa, on the flanks, which reach width m behind the edge. Needs the effect "cut".
    /// </summary>
    public void SetBlade(int number, double[] points, Vector direction = default(Vector), double toughness = 0,
                         double friction = 0, double width = 0) {
      palpate_blade blade = palpate_default_blade();
      blade.point_count = Rows(points, nameof(points));
      blade.toughness = toughness;
      blade.friction = friction;
      blade.width = width;
      Store(direction, blade.direction);
      fixed(double* edge = points) {
        blade.points = edge;
        Set(number, &blade, "SetBlade");
      }
    }

    /// <summary>Takes a blade out: it cuts nothing from the next touch on.</summary>
    public void WithdrawBlade(int number) {
      palpate_blade none = palpate_default_blade();
      Set(number, &none, "WithdrawBlade");
    }

    void Set(int number, palpate_blade* blade, string call) {
      palpate_error error;
      var scene = (palpate_scene*)Begin(ref touches, call);
      try {
        PalpateException.ThrowIfFailed(palpate_scene_set_blade(scene, number, blade, &error), &error);
      } finally {
        End(ref touches);
      }
    }

    /// <summary>A blade after the last touch.</summary>
    public BladeState StateOfBlade(int number) {
      var scene = (palpate_scene*)Begin(ref touches, "StateOfBlade");
      try {
        palpate_blade_state* state = palpate_scene_blade_state(scene, number);
        if (state == null) throw new ArgumentException("the scene has no blade " + number);
        return new BladeState { Force = new Vector(state->force),
                                Torque = new Vector(state->torque),
                                Work = state->work,
                                FrictionWork = state->friction_work,
                                Area = state->area,
                                InTissue = state->in_tissue,
                                Cuts = state->cuts };
      } finally {
        End(ref touches);
      }
    }

    /// <summary>
    /// At the next touch, removes the tetrahedra whose middle lies within radius, m, of a place in the world. With needed, s, each goes once it has been
    /// in such balls for so long, held s of it in this one.
    /// </summary>
    public void RemoveTissue(Vector centre, double radius, double held = 0, double needed = 0) {
      double* numbers = stackalloc double[3];
      palpate_error error;
      Store(centre, numbers);
      var scene = (palpate_scene*)Begin(ref touches, "RemoveTissue");
      try {
        PalpateException.ThrowIfFailed(palpate_scene_remove_tissue(scene, numbers, radius, held, needed, &error),
                                       &error);
      } finally {
        End(ref touches);
      }
    }

    /// <summary>What has been cut, after the last touch.</summary>
    public CutState StateOfCut() {
      var scene = (palpate_scene*)Begin(ref touches, "StateOfCut");
      try {
        palpate_cut_state* state = palpate_scene_cut_state(scene);
        if (state == null) throw new ArgumentException("the scene does not cut");
        return new CutState { Surface = state->surface,     Area = state->area,       Faces = state->faces,
                              Removed = state->removed,     Nodes = state->nodes,     Pieces = state->pieces,
                              Waiting = state->waiting,     Left = state->left,       Rank = state->rank,
                              IsFull = state->is_full != 0, Rebased = state->rebased, Rebasing = state->rebasing != 0 };
      } finally {
        End(ref touches);
      }
    }

    /// <summary>
    /// The surface of what is left, to draw in place of the bundle's triangles: fills triangles with three nodes for each, and isLip with 1 where a cut
    /// made it, as many as there is room for, and returns how many triangles there are. Either may be null. Call it when StateOfCut().Surface has changed.
    /// </summary>
    public int CutSurface(int[] triangles, byte[] isLip = null) {
      int room = triangles == null ? (isLip == null ? 0 : isLip.Length) : triangles.Length / 3;
      if (triangles != null && isLip != null) room = Math.Min(room, isLip.Length);
      var scene = (palpate_scene*)Begin(ref touches, "CutSurface");
      try {
        fixed(int* corners = triangles) fixed(byte* lips = isLip) {
          return palpate_scene_cut_surface(scene, corners, lips, room);
        }
      } finally {
        End(ref touches);
      }
    }

    /// <summary>The render half: x, y, z of each deformed node, m, into your arrays. Either may be null.</summary>
    public palpate_step_flags Shape(Contacts contacts, float[] positions, float[] displacements = null) {
      if (positions != null) Need(positions, ShapeNodeCount, nameof(positions));
      if (displacements != null) Need(displacements, ShapeNodeCount, nameof(displacements));
      fixed(float* p = positions, d = displacements) return Shape(contacts, p, d, ShapeNodeCount);
    }

    /// <summary>The same into memory of another owner, as a NativeArray of Unity; each array has room for `nodes` nodes.</summary>
    public palpate_step_flags Shape(Contacts contacts, float* positions, float* displacements, int nodes) {
      if (contacts == null) throw new ArgumentNullException(nameof(contacts));
      if (nodes < ShapeNodeCount) throw TooShort("positions", ShapeNodeCount, nodes);
      palpate_shape_out shape = palpate_default_shape_out();
      shape.node_capacity = nodes;
      shape.positions = positions;
      shape.displacements = displacements;
      var scene = (palpate_scene*)Begin(ref shapes, "Shape");
      bool locked = false;
      try {
        contacts.Lock(ref locked);
        return palpate_scene_shape(scene, contacts.At, &shape);
      } finally {
        if (locked) contacts.Unlock();
        End(ref shapes);
      }
    }

    /// <summary>Normals of the surface's nodes under the positions that Shape wrote.</summary>
    public palpate_step_flags Normals(float* positions, float* normals, int nodes) {
      int surface = Bundle.Info.surface_node_count;
      if (nodes < surface) throw TooShort("normals", surface, nodes);
      palpate_shape_out shape = palpate_default_shape_out();
      shape.node_count = surface;
      shape.positions = positions;
      var scene = (palpate_scene*)Begin(ref shapes, "Normals");
      try {
        return palpate_scene_normals(scene, &shape, normals, nodes);
      } finally {
        End(ref shapes);
      }
    }

    /// <summary>The render mesh under the displacements that Shape wrote. normals may be null.</summary>
    public palpate_step_flags Skin(float[] displacements, float[] positions, float[] normals = null) {
      Need(displacements, ShapeNodeCount, nameof(displacements));
      Need(positions, SkinVertexCount, nameof(positions));
      if (normals != null) Need(normals, SkinVertexCount, nameof(normals));
      fixed(float* d = displacements, p = positions, n = normals) return Skin(d, p, n, SkinVertexCount);
    }

    public palpate_step_flags Skin(float* displacements, float* positions, float* normals, int vertices) {
      if (vertices < SkinVertexCount) throw TooShort("positions", SkinVertexCount, vertices);
      palpate_shape_out shape = palpate_default_shape_out();
      shape.node_count = ShapeNodeCount;
      shape.displacements = displacements;
      palpate_skin_out skin = palpate_default_skin_out();
      skin.vertex_capacity = vertices;
      skin.positions = positions;
      skin.normals = normals;
      var scene = (palpate_scene*)Begin(ref shapes, "Skin");
      try {
        return palpate_scene_skin(scene, &shape, &skin);
      } finally {
        End(ref shapes);
      }
    }

    /// <summary>The scene forgets its contacts.</summary>
    public void Reset() {
      palpate_scene_reset((palpate_scene*)Begin(ref touches, "Reset"));
      End(ref touches);
    }

    public void Dispose() => handle.Dispose();

    // Copies to memory that does not move.
    palpate_tool* Copy(Tool[] from) {
      var copies = (palpate_tool*)tools.Pointer;
      var grasps = (palpate_grasp*)(copies + PALPATE_MAX_TOOLS);
      var needles = (palpate_needle*)(grasps + PALPATE_MAX_TOOLS);
      int pointNumbers = 0, gripCount = 0;
      foreach (Tool tool in from) {
        if (tool.Points != null && tool.Points.Length % 3 != 0)
          throw new ArgumentException("Points: expected x, y, z of each point, found " + tool.Points.Length +
                                      " numbers");
        pointNumbers += tool.Points?.Length ?? 0;
        gripCount += tool.Grips?.Length ?? 0;
      }
      var point = (double*)Room(ref points, ref pointRoom, pointNumbers, sizeof(double));
      var grip = (palpate_grip*)Room(ref grips, ref gripRoom, gripCount, sizeof(palpate_grip));
      for (int t = 0; t < from.Length; ++t) {
        Tool tool = from[t];
        palpate_tool copy = palpate_default_tool();
        copy.id = tool.Id;
        copy.disc_radius = tool.DiscRadius;
        copy.friction = tool.Friction;
        copy.hold = tool.Hold ? 1 : 0;
        if (tool.TorqueAbout is Vector about) {
          copy.has_torque = 1;
          copy.reference[0] = about.X;
          copy.reference[1] = about.Y;
          copy.reference[2] = about.Z;
        }
        if (tool.Points != null) {
          copy.points = point;
          copy.point_count = tool.Points.Length / 3;
          foreach (double number in tool.Points) *point++ = number;
        }
        if (tool.Grips != null) {
          copy.grips = grip;
          copy.grip_count = tool.Grips.Length;
          foreach (palpate_grip each in tool.Grips) *grip++ = each;
        }
        if (tool.Grasp is palpate_grasp grasp) {
          grasps[t] = grasp;
          palpate_add_part(&copy.parts, &grasps[t].part);
        }
        if (tool.Needle is palpate_needle needle) {
          needles[t] = needle;
          palpate_add_part(&copy.parts, &needles[t].part);
        }
        copies[t] = copy;
      }
      return copies;
    }

    static void* Room(ref Memory memory, ref int room, int count, int bytes) {
      if (memory == null || count > room) {
        memory?.Dispose();
        memory = new Memory((ulong)(Math.Max(count, 16) * bytes));
        room = Math.Max(count, 16);
      }
      return memory.Pointer;
    }

    void* Begin(ref int running, string name) {
      if (Interlocked.CompareExchange(ref running, 1, 0) != 0)
        throw new InvalidOperationException(name + ": this half of the scene already runs in another thread");
      try {
        return handle.Lock();
      } catch {
        Volatile.Write(ref running, 0);
        throw;
      }
    }

    void End(ref int running) {
      handle.Unlock();
      Volatile.Write(ref running, 0);
    }

    static int Rows(Array array, string name) {
      if (array == null || array.Length % 3 != 0)
        throw new ArgumentException(name + ": expected three numbers a row, found " +
                                    (array == null ? "null" : array.Length.ToString()));
      return array.Length / 3;
    }

    static void Need(float[] array, int rows, string name) {
      if (array == null || array.Length < 3 * rows) throw TooShort(name, rows, array == null ? 0 : array.Length / 3);
    }

    static ArgumentException TooShort(string name, int rows,
                                      int found) => new ArgumentException(name + ": expected room for " + rows +
                                                                          " times x, y, z, found " + found);
  }
}
