// A shaft in a bushing, a conformal contact: the upper part of the shaft, and the shell of the bushing above it; or all
// of both, where contact_angle is 180.
// Structured quadrilaterals along the circles, even over the contact.
//
// Lengths in mm, angles in degrees; the shaft's axis lies at x = z = 0, z up. Shaft and bushing touch at the top.
// Physical groups: every name starts with the body it belongs to, punch_ (the bushing) or strip_ (the shaft).
// The case file gives each parameter below a value of its own by name. Its geometry.order = 2 makes the
// elements follow the circles.

DefineConstant[
  radius = 10,                  // of the shaft
  clearance = 0.02,             // the bushing's bore has the radius + clearance
  wall = 3,                     // of the bushing
  shaft_wall = 6,               // of the part of the shaft that is meshed, below radius
  contact_angle = 45,           // to both sides in which the surfaces may touch: the arc must stay within it
  overlap_angle = 3,            // by which the shaft's contact reaches beyond
  margin_angle = 20,            // by which both bodies go on beyond; not where contact_angle is 180
  elements_along_contact = 60,  // even, so that a node lies at x = 0
  margin_elements = 6,
  growth = 0.5,                 // growth of the element size per length away from the contact
  diffusion_area = 0            // diffusivity over the angular speed of a strip that turns, mm²/rad; 0: not known
];

If(diffusion_area < 0)
  Error("diffusion_area must not be negative");
EndIf
If(radius <= 0 || wall <= 0 || shaft_wall <= 0 || shaft_wall >= radius)
  Error("radius, wall and shaft_wall must be positive, shaft_wall smaller than radius");
EndIf
If(clearance < 0)
  Error("clearance must not be negative: the shaft would be larger than its bore");
EndIf
whole = (contact_angle >= 180) ? 1 : 0;
If(contact_angle <= 0 || contact_angle > 180 || overlap_angle <= 0 || margin_angle <= 0)
  Error("contact_angle, overlap_angle and margin_angle must be positive, and contact_angle at most 180 degrees");
EndIf
If(!whole && contact_angle + overlap_angle + margin_angle > 175)
  Error("contact_angle, overlap_angle and margin_angle must be at most 175 degrees in all, or contact_angle 180");
EndIf
If(clearance >= 0.2 * radius)
  Error("clearance must be small against the radius");
EndIf
wide = (contact_angle > 80) ? 1 : 0;    // then in two arcs to each side
If(elements_along_contact < 2 || elements_along_contact % (2 + 2 * wide) != 0 || margin_elements < 1 || growth <= 0)
  Error("elements_along_contact must be even (beyond 80 degrees a multiple of 4), margin_elements at least 1 and growth positive");
EndIf

degree = Pi / 180;
half_count = elements_along_contact / 2;
size = radius * contact_angle * degree / half_count;
overlap_count = Ceil(overlap_angle / contact_angle * half_count);
angles[] = {}; counts[] = {}; levels[] = {};    // arcs to each side: 0 contact, 1 overlap, 2 margin
If(wide)
  angles[] += contact_angle / 2; counts[] += half_count / 2; levels[] += 0;
EndIf
angles[] += contact_angle; counts[] += half_count / (1 + wide); levels[] += 0;
If(!whole)
  angles[] += {contact_angle + overlap_angle, contact_angle + overlap_angle + margin_angle};
  counts[] += {overlap_count, margin_elements}; levels[] += {1, 2};
EndIf
last = #angles[] - 1;

// Both bodies: sectors between the circle of the contact and another one about the same centre.
near[] = {radius + clearance, radius};
far[] = {radius + clearance + wall, radius - shaft_wall};
// At the shaft's surface elements are at most as high as the layer that heats up while it passes.
layer = Sqrt(diffusion_area * 2 * contact_angle * degree);
sizes[] = {size, (layer > 0 && layer < size) ? layer : size};
centres[] = {-clearance, 0};    // the bushing rests on the shaft's top
For body In {0 : 1}
  z = centres[body];
  span = Fabs(far[body] - near[body]);
  Ratio = 1 + growth * span / sizes[body];
  Count = Ceil(Log(Ratio) / Log(1 + growth));
  Ratio = Ratio ^ (1 / Count);
  o = newp; Point(o) = {0, z, 0};
  p = newp; Point(p) = {0, z + near[body], 0}; near_middle = p;
  p = newp; Point(p) = {0, z + far[body], 0}; far_middle = p;
  l = newl; Line(l) = {near_middle, far_middle}; middle = l;
  Transfinite Curve{l} = Count + 1 Using Progression Ratio;
  faces~{body}[] = {}; contact~{body}[] = {}; free~{body}[] = {}; outer~{body}[] = {}; ends~{body}[] = {};
  For side In {0 : 1}
    a0 = near_middle; b0 = far_middle; inner = middle;
    For i In {0 : last}
      If(whole && side == 1 && i == last)    // the way around is closed
        a1 = a_closed; b1 = b_closed; l = l_closed;
      Else
        angle = (2 * side - 1) * angles[i] * degree;
        p = newp; Point(p) = {near[body] * Sin(angle), z + near[body] * Cos(angle), 0}; a1 = p;
        p = newp; Point(p) = {far[body] * Sin(angle), z + far[body] * Cos(angle), 0}; b1 = p;
        l = newl; Line(l) = {a1, b1};
        Transfinite Curve{l} = Count + 1 Using Progression Ratio;
        If(side == 0)
          a_closed = a1; b_closed = b1; l_closed = l;
        EndIf
      EndIf
      a = newl; Circle(a) = {a0, o, a1};
      b = newl; Circle(b) = {b0, o, b1};
      Transfinite Curve{a, b} = counts[i] + 1;
      If(levels[i] <= body)    // the shaft's contact reaches farther than the bushing's
        contact~{body}[] += a;
      Else
        free~{body}[] += a;
      EndIf
      outer~{body}[] += b;
      If(levels[i] == 2)
        ends~{body}[] += l;
      EndIf
      k = newll; Curve Loop(k) = {a, l, -b, -inner};
      s = news; Plane Surface(s) = {k}; faces~{body}[] += s;
      a0 = a1; b0 = b1; inner = l;
    EndFor
  EndFor
EndFor

Transfinite Surface{:};
Recombine Surface{:};

// ---- The contract: named physical groups ------------------------------------------------------
Physical Surface("punch_body") = faces_0[];
Physical Curve("punch_contact") = contact_0[];
Physical Curve("punch_top") = outer_0[];              // the outer side, which the housing presses
Physical Surface("strip_body") = faces_1[];
Physical Curve("strip_contact") = contact_1[];
Physical Curve("strip_bottom") = outer_1[];           // inside the shaft
If(!whole)
  Physical Curve("punch_free") = free_0[];
  Physical Curve("punch_sides") = ends_0[];
  Physical Curve("strip_free") = free_1[];
  Physical Curve("strip_ends") = ends_1[];
EndIf
