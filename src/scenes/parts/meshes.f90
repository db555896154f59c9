!! Gear meshes, and the mean speeds of bodies.
!!
!! Between inertias d = r1 φ1 - r2 φ2 + Δ(t): their angles count in the senses in which they turn. Those of bodies in the plane all
!! count anticlockwise.
!!
!! Base circles of radius r1 and r2 have their centres c1 and c2 in bodies or points of bodies, a apart in the direction e from the
!! first to the second. With σ = 1 for external teeth and -1 for internal ones the working pressure angle is cos α = |r1 + σ r2|/a.
!! The pitch point P lies on the line of centres at c1 + e a r1/(r1 + σ r2), and the line of action goes through it along
!!
!!     n = ±cos α e⊥ + σ sin α e,
!!
!! so that the force on the second body drives the wheels apart, or an internal one away from its ring. The deformation is the
!! approach along n of what is at P, d = n·(u1 - u2) ± (r1 φ1 + σ r2 φ2) + Δ(t), with + where a positive torque on the first body
!! loads the working flanks. Both forces act along one line, so a mesh turns no machine.
module razy_scenes_parts_meshes
   use razy_core_error, only: error_t
   use razy_core_kinds, only: qp, wp
   use razy_core_number, only: decimal
   use razy_input_input, only: input_t
   use razy_machine_machine, only: contact_t
   use razy_scenes_gears, only: join_meshes, read_gear_mesh
   use razy_scenes_harmonics, only: harmonics_t
   use razy_scenes_parts_bodies, only: add_turn, bodies_t, of_mass
   use razy_scenes_parts_links, only: find_points, find_row, link_t
   implicit none(type, external)
   private

   public :: find_speeds, read_meshes

contains

   !> All meshes, as the first contacts of a machine; `ratio` (bodies) are mean speeds over that of `&rotation`.
   subroutine read_meshes(contact, mesh, ratio, input, harmonics, error)
      type(contact_t), intent(inout) :: contact(:)
      type(link_t), intent(in) :: mesh(:)
      real(qp), intent(in) :: ratio(:)
      type(input_t), intent(in) :: input
      type(harmonics_t), intent(inout) :: harmonics
      type(error_t), allocatable, intent(out) :: error

      integer :: i

      do i = 1, size(mesh)
         associate (row => size(mesh(i)%w) + i)
            call read_gear_mesh(contact(i), input, i, mesh(i)%w, ratio(mesh(i)%first%body), "a body that springs and meshes", &
                                harmonics, [row, row + size(contact)], error)
         end associate
         if (allocated(error)) return
      end do
   end subroutine read_meshes

   !> Mesh i as a link, in the plane at the pitch point along the line of action.
   subroutine find_mesh(mesh, bodies, input, i, error)
      type(link_t), intent(inout) :: mesh
      type(bodies_t), intent(in) :: bodies
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      type(error_t), allocatable, intent(out) :: error

      character(*), parameter :: of_shafts(*) = [character(14) :: "node", "pressure_angle", "helix_angle", "hand", "centre_line", &
                                                                                                             "offset"]
      character(:), allocatable :: drive, kind
      real(wp), allocatable :: radius(:)
      real(wp) :: apart, base, e(2), way
      integer :: k

      call find_points(mesh, bodies, input, "gear_mesh", i, 1, error)
      k = findloc([(input%differs("gear_mesh", i, trim(of_shafts(k))), k=1, size(of_shafts))], .true., dim=1)
      if (k > 0 .and. .not. allocated(error)) call input%complain(error, "gear_mesh", i, trim(of_shafts(k)), &
                                                                  "left out without shafts")
      if (allocated(error)) return
      call input%get("gear_mesh", i, "radius", radius)
      kind = input%choice("gear_mesh", i, "kind")
      drive = input%choice("gear_mesh", i, "drive")
      if (any(bodies%kind([mesh%first%body, mesh%second%body]) /= bodies%kind(mesh%first%body)) .or. &
          bodies%kind(mesh%first%body) == of_mass) then
         call input%complain(error, "gear_mesh", i, "between", "two inertias, or two bodies in the plane; a wheel that "// &
                             "stands is one on springs")
      else if (mesh%turns) then
         if (kind//drive /= "externalpositive") then
            call input%complain(error, "gear_mesh", i, "kind", "'external', and drive = 'positive', between inertias, whose "// &
                                "angles count as they turn")
         end if
         mesh%w = 0*bodies%mass
         call add_turn(mesh%w, bodies, mesh%first, radius(1))
         call add_turn(mesh%w, bodies, mesh%second, -radius(2))
      end if
      if (allocated(error) .or. mesh%turns) return
      way = merge(1.0_wp, -1.0_wp, kind == "external")
      base = radius(1) + way*radius(2)
      e = mesh%second%place - mesh%first%place
      apart = norm2(e)
      if (.not. abs(base) > 0.0_wp) then
         call input%complain(error, "gear_mesh", i, "radius", "two different base radii where kind = 'internal'")
      else if (.not. apart > abs(base)) then
         call input%complain(error, "gear_mesh", i, "radius", "base radii whose "// &
                             trim(merge("sum       ", "difference", way > 0.0_wp))//" is less than the distance of the "// &
                             "centres, "//decimal(1000*apart, 6)//" mm: over it, it is the cosine of the pressure angle")
      end if
      if (allocated(error)) return
      e = e/apart
      mesh%direction = merge(1.0_wp, -1.0_wp, drive == "positive")*base/apart*[-e(2), e(1)] &
                       + way*sqrt((apart - base)*(apart + base))/apart*e
      mesh%first%arm = mesh%first%arm + apart*radius(1)/base*e
      mesh%second%arm = mesh%second%arm - apart*way*radius(2)/base*e
      call find_row(mesh, bodies, input, error)
   end subroutine find_mesh

   !> All meshes, and mean speeds of all bodies over that of `&rotation`, 0 where nothing says what it is: `links` that turn, and
   !> teeth, join them.
   subroutine find_speeds(mesh, ratio, links, bodies, input, error)
      type(link_t), allocatable, intent(out) :: mesh(:)
      real(qp), allocatable, intent(out) :: ratio(:)
      type(link_t), intent(in) :: links(:)
      type(bodies_t), intent(in) :: bodies
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      character(*), parameter :: of_rotation(3) = [character(11) :: "of", "gyroscopic", "circulatory"]
      integer :: coupled(2, size(links)), ends(2, input%count("gear_mesh")), i, k, way(input%count("gear_mesh"))
      logical :: known(bodies%count)

      allocate (mesh(size(way)), ratio(bodies%count))
      do i = 1, size(mesh)
         call find_mesh(mesh(i), bodies, input, i, error)
         if (allocated(error)) return
         if (any([(bears(links(k), mesh(i)), k=1, size(links))])) then
            call input%complain(error, "gear_mesh", i, "between", "two wheels of which neither stands in the other: "// &
                                "a carrier is no wheel of the planets that it carries")
            return
         end if
         ends(:, i) = [mesh(i)%first%body, mesh(i)%second%body]
         way(i) = merge(1, merge(-1, 1, input%choice("gear_mesh", i, "kind") == "external"), mesh(i)%turns)
      end do
      do i = 1, size(links)
         coupled(:, i) = merge([links(i)%first%body, links(i)%second%body], 0, links(i)%turns)
      end do
      ratio = 0.0_qp
      if (input%count("rotation") == 0) return
      i = findloc([input%given("rotation", 1, "of"),.not. [(input%differs("rotation", 1, trim(of_rotation(k))), k=2, 3)]], &
                  .false., dim=1)
      if (i > 0) call input%complain(error, "rotation", 1, trim(of_rotation(i)), &
                                     trim(merge("required", "left out", i == 1))//" without shafts")
      if (allocated(error)) return
      call join_meshes(ratio, known, bodies%name, bodies%kind(1:) /= of_mass, ends, way, coupled, input, error)
   end subroutine find_speeds

   !> Whether a link joins points of both wheels of a mesh that lie on one another, as bearings do.
   pure logical function bears(link, mesh)
      type(link_t), intent(in) :: link, mesh

      associate (ends => [link%first%body, link%second%body], wheels => [mesh%first%body, mesh%second%body])
         bears = .not. link%turns .and. link%first%located .and. link%second%located .and. &
                 (all(ends == wheels) .or. all(ends == wheels([2, 1])))
      end associate
      if (bears) bears = norm2(link%first%place - link%second%place) < 1.0e-6_wp*norm2(mesh%first%place - mesh%second%place)
   end function bears

end module razy_scenes_parts_meshes
