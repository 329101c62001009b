using Palpate.Native;

namespace Palpate {
  /// <summary>
  /// A rigid surface that the organ does not enter: a table, a rib, a plate. A scene copies it when it is created; Scene.SetObstaclePose moves it.
  /// </summary>
  public sealed class Obstacle {
    public palpate_obstacle_kind Kind;
    /// <summary>m, of a rectangle: its lengths along x and y; of a disc: the radius, in SizeX. The organ is on the side of z.</summary>
    public double SizeX, SizeY;
    /// <summary>Of a mesh: closed or open, its triangles counter-clockwise from outside.</summary>
    public Surface Mesh;
    public double Friction;
    /// <summary>m: a node that is farther inside is not held.</summary>
    public double Depth = 0.01;
    /// <summary>In the world, when the scene begins.</summary>
    public Vector Position;
    public Turn Orientation = Turn.None;

    public static Obstacle Rectangle(double x, double y) => new Obstacle { Kind = palpate_obstacle_kind.RECTANGLE,
                                                                           SizeX = x, SizeY = y };
    public static Obstacle Disc(double radius) => new Obstacle { Kind = palpate_obstacle_kind.DISC, SizeX = radius };
    public static Obstacle OfMesh(Surface mesh) => new Obstacle { Kind = palpate_obstacle_kind.MESH, Mesh = mesh };
  }

  /// <summary>A quaternion of length 1.</summary>
  public struct Turn {
    public double W, X, Y, Z;

    public Turn(double w, double x, double y, double z) {
      W = w;
      X = x;
      Y = y;
      Z = z;
    }

    public static readonly Turn None = new Turn(1, 0, 0, 0);
  }

  /// <summary>An obstacle after a touch, in the world: force, N, and torque, N m, on it; how many nodes press it, and how far one is inside, m.</summary>
  public struct ObstacleState {
    public Vector Force, Torque, Position;
    public double Deepest;
    public int Nodes, Slips;
  }
}
