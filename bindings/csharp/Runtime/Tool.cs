using Palpate.Native;

namespace Palpate {
  /// <summary>One instrument. Write into its fields and arrays before a touch; the touch copies them.</summary>
  public sealed class Tool {
    /// <summary>x, y, z of each point that is tested against the surface, m.</summary>
    public double[] Points = new double[3];
    /// <summary>m, of the flat disc that each point presses under contact "patch". Without a radius the force has no meaning in newtons.</summary>
    public double DiscRadius;
    /// <summary>For the law "coulomb".</summary>
    public double Friction;
    /// <summary>Contacts stay when the point has come out, and pull.</summary>
    public bool Hold;
    /// <summary>0 or more, by which the scene knows the tool from step to step; -1: its index.</summary>
    public int Id = -1;
    /// <summary>A point, m: the contacts then have the torque about it.</summary>
    public Vector? TorqueAbout;
    /// <summary>Places that the tool holds. Begin each with palpate_default_grip().</summary>
    public palpate_grip[] Grips;
    /// <summary>Jaws, closed in each touch that has them. Begin with palpate_default_grasp().</summary>
    public palpate_grasp? Grasp;
    /// <summary>A needle in or before the tissue. Begin with palpate_default_needle().</summary>
    public palpate_needle? Needle;

    /// <summary>Moves a tool of one point.</summary>
    public void MoveTo(Vector point) {
      Points[0] = point.X;
      Points[1] = point.Y;
      Points[2] = point.Z;
    }
  }

  /// <summary>Three numbers in the bundle's frame.</summary>
  public struct Vector {
    public double X, Y, Z;

    public Vector(double x, double y, double z) {
      X = x;
      Y = y;
      Z = z;
    }

    internal unsafe Vector(double* from) : this(from[0], from[1], from[2]) {}
    public static Vector operator +(Vector a, Vector b) => new Vector(a.X + b.X, a.Y + b.Y, a.Z + b.Z);
    public static Vector operator -(Vector a, Vector b) => new Vector(a.X - b.X, a.Y - b.Y, a.Z - b.Z);
    public static Vector operator*(Vector a, double by) => new Vector(a.X * by, a.Y* by, a.Z* by);
    public static Vector Cross(Vector a, Vector b) => new Vector(a.Y * b.Z - a.Z * b.Y, a.Z* b.X - a.X * b.Z,
                                                                 a.X* b.Y - a.Y * b.X);
    public double Length => System.Math.Sqrt(X * X + Y * Y + Z * Z);
  }
}
