// A ball in a cup, a conformal contact as that of a hip: the cup, a shell above, and the outer shell of the ball in it.
// Structured hexahedra: a square about the pole, and four sides around it.
//
// Lengths in mm, angles in degrees; the ball's middle lies at x = y = z = 0, the pole of both is up (z).
// Ball and cup touch at the pole. Physical groups: every name starts with the body it belongs to, punch_ (the cup)
// or strip_ (the ball). The case file's geometry.order = 2 makes the elements follow the spheres.

DefineConstant[
  radius = 14,            // of the ball
  clearance = 0.1,        // radial: the cup's sphere has the radius + clearance
  wall = 8,               // of the cup
  ball_wall = 5,          // of the ball's shell that is meshed, below radius; its inside is held or loaded
  contact_angle = 90,     // from the pole in which the surfaces may touch: 90 is a hemisphere
  overlap_angle = 5,      // by which the ball's contact reaches beyond; a ball that wears turns within it
  across = 8,             // elements over the square about the pole, even
  around = 6,             // elements from the square to the rim
  overlap_elements = 1,   // from the rim on the ball's contact on
  cup_layers = 3,         // elements over the wall
  ball_layers = 3,        // elements over the ball's wall
  growth = 1.6            // of an element's height over that of its neighbour towards the contact
];

If(radius <= 0 || clearance < 0 || wall <= 0 || ball_wall <= 0 || ball_wall >= radius)
  Error("radius, wall and ball_wall must be positive, ball_wall smaller than radius, and clearance not negative: a ball larger than its cup does not go in");
EndIf
If(clearance >= 0.2 * radius)
  Error("clearance must be small against the radius");
EndIf
If(contact_angle < 10 || contact_angle > 90 || overlap_angle <= 0 || contact_angle + overlap_angle > 160)
  Error("contact_angle must be 10 to 90 degrees, overlap_angle positive, both together at most 160");
EndIf
If(across < 2 || across % 2 != 0 || around < 1 || overlap_elements < 1 || cup_layers < 1 || ball_layers < 1 || growth <= 0)
  Error("across must be even, around, overlap_elements and the layers at least 1, growth positive");
EndIf

degree = Pi / 180;
// Polar angles of the corners of the square, of the rim, and of the end of the ball.
square = 54.7356 * contact_angle / 90;
rings[] = {square, contact_angle, contact_angle + overlap_angle};
counts[] = {0, around, overlap_elements};
near[] = {radius + clearance, radius};
far[] = {radius + clearance + wall, radius - ball_wall};
middle[] = {-clearance, 0};     // the cup rests on the ball's pole
layers[] = {cup_layers, ball_layers};

For body In {0 : 1}
  z0 = middle[body];
  c = newp; Point(c) = {0, 0, z0};
  last = 1 + body;              // the ball reaches one ring farther
  contact~{body}[] = {}; back~{body}[] = {}; ends~{body}[] = {}; volumes~{body}[] = {};
  // Points p, arcs around a, ways down the sphere d, lines through the wall w, by ring, shell (0 near, 1 far) and corner.
  p[] = {}; a[] = {}; d[] = {}; w[] = {};
  For i In {0 : last}
    t = rings[i] * degree;
    For k In {0 : 1}
      r = (k == 0) ? near[body] : far[body];
      For j In {0 : 3}
        f = (45 + 90 * j) * degree;
        n = newp; Point(n) = {r * Sin(t) * Cos(f), r * Sin(t) * Sin(f), z0 + r * Cos(t)}; p[] += n;
      EndFor
    EndFor
  EndFor
  For i In {0 : last}
    t = rings[i] * degree;
    For k In {0 : 1}
      r = (k == 0) ? near[body] : far[body];
      If(i == 0)
        o = c;                  // great circles bound the square
      Else
        o = newp; Point(o) = {0, 0, z0 + r * Cos(t)};
      EndIf
      For j In {0 : 3}
        l = newl; Circle(l) = {p[j + 4 * (k + 2 * i)], o, p[(j + 1) % 4 + 4 * (k + 2 * i)]}; a[] += l;
        Transfinite Curve{l} = across + 1;
      EndFor
      If(i > 0)
        For j In {0 : 3}
          l = newl; Circle(l) = {p[j + 4 * (k + 2 * (i - 1))], c, p[j + 4 * (k + 2 * i)]}; d[] += l;
          Transfinite Curve{l} = counts[i] + 1;
        EndFor
      EndIf
    EndFor
    For j In {0 : 3}
      l = newl; Line(l) = {p[j + 8 * i], p[j + 4 + 8 * i]}; w[] += l;
      Transfinite Curve{l} = layers[body] + 1 Using Progression growth;
    EndFor
  EndFor
  // Faces on the spheres s, and through the wall: v around (by ring), u down.
  s[] = {}; v[] = {}; u[] = {};
  For k In {0 : 1}
    n = newll; Curve Loop(n) = {a[0 + 4 * k], a[1 + 4 * k], a[2 + 4 * k], a[3 + 4 * k]};
    f = news; Surface(f) = {n} In Sphere {c}; s[] += f;
  EndFor
  For i In {0 : last}
    For j In {0 : 3}
      n = newll;
      Curve Loop(n) = {a[j + 8 * i], w[(j + 1) % 4 + 4 * i], -a[j + 4 + 8 * i], -w[j + 4 * i]};
      f = news; Surface(f) = {n}; v[] += f;
    EndFor
  EndFor
  For i In {1 : last}
    For k In {0 : 1}
      For j In {0 : 3}
        n = newll;
        Curve Loop(n) = {a[j + 4 * (k + 2 * (i - 1))], d[(j + 1) % 4 + 4 * (k + 2 * (i - 1))],
                         -a[j + 4 * (k + 2 * i)], -d[j + 4 * (k + 2 * (i - 1))]};
        f = news; Surface(f) = {n} In Sphere {c}; s[] += f;
      EndFor
    EndFor
    For j In {0 : 3}
      n = newll;
      Curve Loop(n) = {d[j + 8 * (i - 1)], w[j + 4 * i], -d[j + 4 + 8 * (i - 1)], -w[j + 4 * (i - 1)]};
      f = news; Plane Surface(f) = {n}; u[] += f;
    EndFor
  EndFor
  n = newsl; Surface Loop(n) = {s[0], s[1], v[0], v[1], v[2], v[3]};
  f = newv; Volume(f) = {n}; volumes~{body}[] += f;
  contact~{body}[] += s[0]; back~{body}[] += s[1];
  For i In {1 : last}
    For j In {0 : 3}
      m = 2 + 8 * (i - 1) + j;
      n = newsl;
      Surface Loop(n) = {s[m], s[m + 4], v[j + 4 * (i - 1)], v[j + 4 * i], u[j + 4 * (i - 1)], u[(j + 1) % 4 + 4 * (i - 1)]};
      f = newv; Volume(f) = {n}; volumes~{body}[] += f;
      contact~{body}[] += s[m]; back~{body}[] += s[m + 4];
      If(i == last)
        ends~{body}[] += v[j + 4 * i];
      EndIf
    EndFor
  EndFor
  Transfinite Surface{s[], v[], u[]};
  Recombine Surface{s[], v[], u[]};
  Transfinite Volume{volumes~{body}[]};
EndFor

Physical Volume("punch_body") = volumes_0[];
Physical Surface("punch_contact") = contact_0[];
Physical Surface("punch_back") = back_0[];     // which the shell around it presses
Physical Surface("punch_rim") = ends_0[];
Physical Volume("strip_body") = volumes_1[];
Physical Surface("strip_contact") = contact_1[];
Physical Surface("strip_inside") = back_1[];   // on the stem
Physical Surface("strip_end") = ends_1[];
