!! &planetary: a planetary gear as the bodies, springs and meshes that it is made of.
!!
!! The group is replaced by those it stands for before the input is checked, so that nothing behind knows of it, and `--check` shows
!! them. N planets at the angles ψ mesh with a sun of S and a ring of R teeth: they can be assembled where (S + R) ψ is a whole
!! number of turns. At time 0 their teeth are -S ψ and R ψ of the periods of both meshes ahead of those at ψ = 0.
module razy_scenes_parts_planetary
   use razy_core_angle, only: turn
   use razy_core_error, only: error_t
   use razy_core_kinds, only: pi, wp
   use razy_core_number, only: to_text
   use razy_core_text, only: newline, string_t
   use razy_input_input, only: check_input, input_t
   use razy_input_reader, only: entries_t, pick, read_entries
   use razy_input_schema, only: add_group, add_integer, add_name, add_real, group_at, group_spec_t, nonnegative, positive
   implicit none(type, external)
   private

   public :: add_planetary, expand_planetary

   integer, parameter :: most_planets = 32
   !> Planets may stand this share of a tooth beside the place where they fit.
   real(wp), parameter :: rounded = 1.0e-3_wp

contains

   !> Add the group to a schema.
   subroutine add_planetary(schema)
      type(group_spec_t), allocatable, intent(inout) :: schema(:)

      call add_group(schema, "planetary", "A planetary gear about the origin: becomes the bodies carrier, ring, sun, p1, p2, "// &
                     "..., the meshes s1, r1, ... and springs, as --check shows", repeatable=.true.)
      call add_name(schema, required=.false.)
      call add_integer(schema, "planets", "number of planets", low=1, high=most_planets, required=.true.)
      call add_real(schema, "angles", "their places, anticlockwise from the x axis; evenly spaced if left out", unit="deg", &
                    least=1, most=most_planets)
      call add_integer(schema, "teeth", "numbers of teeth: sun, planet, ring", rule=positive, count=3, required=.true.)
      call add_real(schema, "radius", "base radii: sun, planet, ring", unit="m", rule=positive, count=3, required=.true.)
      call add_real(schema, "distance", "of the axes of sun and planets", unit="m", rule=positive, required=.true.)
      call add_real(schema, "mass", "masses: carrier, ring, sun, each planet", unit="kg", rule=positive, count=4, required=.true.)
      call add_real(schema, "inertia", "moments of inertia likewise", unit="kg m^2", rule=positive, count=4, required=.true.)
      call add_real(schema, "bearing", "stiffness along x and along y: carrier, ring and sun in the frame, each planet in the "// &
                    "carrier; 0: none", unit="N/m", rule=nonnegative, count=4, required=.true.)
      call add_real(schema, "ring_stiffness", "stiffness of the ring against turning, by its bearing on a circle; 0: it turns", &
                    unit="N m/rad", rule=nonnegative, default="0.0")
      call add_real(schema, "stiffness", "mesh stiffness: sun and planet, planet and ring", unit="N/m", rule=positive, count=2, &
                    required=.true.)
      call add_real(schema, "damping", "mesh damping likewise", unit="N s/m", rule=nonnegative, count=2, default="0.0, 0.0")
      call add_real(schema, "backlash", "backlash likewise", unit="m", rule=nonnegative, count=2, default="0.0, 0.0")
      call add_real(schema, "contact_ratio", "mesh stiffness that switches, likewise, as of &gear_mesh", low=1.0_wp, high=10.0_wp, &
                    count=2, default="1.0, 1.0")
      call add_real(schema, "mesh_phase", "where the teeth of a planet at the angle 0 are in their periods at time 0, "// &
                    "likewise; those of the others follow from their places", unit="deg", count=2, default="0.0, 0.0")
   end subroutine add_planetary

   !> Put what each &planetary of a text stands for in its place; `schema` is that of the scene.
   subroutine expand_planetary(said, text, overrides, schema, error)
      type(entries_t), intent(inout) :: said
      character(*), intent(in) :: text
      type(string_t), intent(in) :: overrides(:)
      type(group_spec_t), intent(in) :: schema(:)
      type(error_t), allocatable, intent(out) :: error

      type(entries_t) :: own, whole
      type(input_t) :: input
      character(:), allocatable :: parts
      integer :: i, lines

      call pick(said, [(said%list(i)%path%group == "planetary", i=1, size(said%list))], own)
      i = group_at(schema, "planetary")
      if (i == 0 .or. size(own%list) == 0) return
      call check_input(input, own, schema(i:i), error)
      parts = ""
      do i = 1, input%count("planetary")
         if (.not. allocated(error)) call add_parts(parts, input, i, error)
      end do
      if (.not. allocated(error)) call read_entries(whole, text//parts, said%file, overrides, error)
      if (allocated(error)) return
      call pick(whole, [(whole%list(i)%path%group /= "planetary", i=1, size(whole%list))], said)
      lines = count([(text(i:i) == newline, i=1, len(text))])
      do i = 1, size(said%list)
         if (said%list(i)%line > lines) said%list(i)%line = own%list(1)%line
      end do
   end subroutine expand_planetary

   !> Add the groups that &planetary number i stands for.
   subroutine add_parts(text, input, i, error)
      character(:), allocatable, intent(inout) :: text
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      type(error_t), allocatable, intent(out) :: error

      character(*), parameter :: bodies(3) = ["carrier", "ring   ", "sun    "], sides(4) = ["east ", "north", "west ", "south"]
      integer, allocatable :: teeth(:)
      real(wp), allocatable :: angles(:)
      character(:), allocatable :: pins, prefix, planet
      complex(wp) :: at
      real(wp) :: across, held
      integer :: k, n, p

      call input%get("planetary", i, "name", prefix)
      if (len(prefix) > 0) prefix = prefix//"_"
      call input%get("planetary", i, "planets", n)
      call input%get("planetary", i, "teeth", teeth)
      call input%get("planetary", i, "ring_stiffness", held)
      angles = reals("angles")
      if (size(angles) == 0) angles = [(360.0_wp*(p - 1)/n, p=1, n)]
      associate (bearing => reals("bearing"), beside => (angles - angles(1))*(teeth(1) + teeth(3))/360)
         if (size(angles) /= n) then
            call input%complain(error, "planetary", i, "angles", to_text(n)//", one for each planet")
         else if (any(abs(beside - anint(beside)) > rounded)) then
            call input%complain(error, "planetary", i, "teeth", "such that the planets can be assembled: from one to the next "// &
                                "they turn the sum of the teeth of sun and ring, "//to_text(teeth(1) + teeth(3))// &
                                ", by a whole number")
         else if (any([((abs(sin((angles(p) - angles(k))*pi/360))*(teeth(1) + teeth(2)) <= teeth(2), k=1, p - 1), p=1, n)])) then
            call input%complain(error, "planetary", i, "planets", "so few that neighbours do not touch")
         else if (held > 0.0_wp .and. .not. bearing(2) > 0.0_wp) then
            call input%complain(error, "planetary", i, "bearing", "one of the ring too, where it has a ring_stiffness")
         else
            call input%refuse_alone(error, "planetary", i, "mesh_phase", "contact_ratio")
         end if
         if (allocated(error)) return
         do k = 1, 3
            call add_body(trim(bodies(k)), k, (0.0_wp, 0.0_wp))
            if (bearing(k) > 0.0_wp .and. .not. (k == 2 .and. held > 0.0_wp)) then
               call hold(of(trim(bodies(k)))//",'frame'", of(trim(bodies(k)))//",'frame'", bearing(k))
            end if
         end do
         if (held > 0.0_wp) then
            across = sqrt(held/(2*bearing(2)))
            do k = 1, 4
               call add("point", trim(sides(k)), "body="//of("ring")//" position="//both(across*turn(90.0_wp*(k - 1))))
            end do
            call hold(of("north")//",'frame',"//of("south")//",'frame'", of("east")//",'frame',"//of("west")//",'frame'", &
                      bearing(2))
         end if
         pins = ""
         do p = 1, n
            at = input%number("planetary", i, "distance")*turn(angles(p))
            planet = of("p"//to_text(p))
            call add_body("p"//to_text(p), 4, at)
            call add("point", "pin"//to_text(p), "body="//of("carrier")//" position="//both(at))
            pins = pins//","//planet//","//of("pin"//to_text(p))
            call add_mesh("s", [1, 2], of("sun")//","//planet, 1, -teeth(1)*angles(p))
            call add_mesh("r", [2, 3], planet//","//of("ring")//" kind='internal' drive='negative'", 2, teeth(3)*angles(p))
         end do
         if (bearing(4) > 0.0_wp) call hold(pins(2:), pins(2:), n*bearing(4))
      end associate

   contains

      function reals(key) result(values)
         character(*), intent(in) :: key
         real(wp), allocatable :: values(:)

         call input%get("planetary", i, key, values)
      end function reals

      pure function of(name) result(quoted)
         character(*), intent(in) :: name
         character(:), allocatable :: quoted

         quoted = "'"//prefix//name//"'"
      end function of

      pure function both(z) result(numbers)
         complex(wp), intent(in) :: z
         character(:), allocatable :: numbers

         numbers = to_text(z%re)//","//to_text(z%im)
      end function both

      subroutine add(group, name, rest)
         character(*), intent(in) :: group, name, rest

         text = text//"&"//group//" name="//of(name)//" "//rest//" / "
      end subroutine add

      !> A body with mass and inertia number k.
      subroutine add_body(name, k, centre)
         character(*), intent(in) :: name
         integer, intent(in) :: k
         complex(wp), intent(in) :: centre

         associate (mass => reals("mass"), inertia => reals("inertia"))
            call add("body", name, "mass="//to_text(mass(k))//" inertia="//to_text(inertia(k))//" centre="//both(centre))
         end associate
      end subroutine add_body

      subroutine hold(along_x, along_y, stiffness)
         character(*), intent(in) :: along_x, along_y
         real(wp), intent(in) :: stiffness

         text = text//"&spring between="//along_x//" direction=1.0,0.0 stiffness="//to_text(stiffness)//" / &spring between="// &
                along_y//" direction=0.0,1.0 stiffness="//to_text(stiffness)//" / "
      end subroutine hold

      !> Mesh of planet p with values number k of the group; of both wheels these are numbers `wheel`; its phase is `ahead`, deg.
      subroutine add_mesh(name, wheel, between, k, ahead)
         character(*), intent(in) :: name, between
         integer, intent(in) :: wheel(2), k
         real(wp), intent(in) :: ahead

         character(:), allocatable :: ratio

         associate (radius => reals("radius"), stiffness => reals("stiffness"), damping => reals("damping"), &
                    phase => reals("mesh_phase"), backlash => reals("backlash"), &
                    contact_ratio => reals("contact_ratio"))
            ratio = ""
            if (contact_ratio(k) > 1.0_wp) ratio = " contact_ratio="//to_text(contact_ratio(k))//" mesh_phase="// &
                                                   to_text(modulo(phase(k) + ahead, 360.0_wp))
            call add("gear_mesh", name//to_text(p), "between="//between//" teeth="//to_text(teeth(wheel(1)))//","// &
                     to_text(teeth(wheel(2)))//" radius="//to_text(radius(wheel(1)))//","//to_text(radius(wheel(2)))// &
                     " stiffness="//to_text(stiffness(k))//" damping="//to_text(damping(k))//" backlash="//to_text(backlash(k))// &
                     ratio)
         end associate
      end subroutine add_mesh

   end subroutine add_parts

end module razy_scenes_parts_planetary
