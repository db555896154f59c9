!! Gear meshes between bodies of a planar scene, whose angles all count anticlockwise.
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
module razy_scenes_planar_meshes
   use razy_core_error, only: error_t
   use razy_core_kinds, only: qp, wp
   use razy_core_number, only: decimal
   use razy_core_text, only: did_you_mean, excerpt, position_of
   use razy_input_input, only: input_t
   use razy_machine_machine, only: contact_t
   use razy_scenes_gears, only: join_meshes, read_gear_mesh
   use razy_scenes_harmonics, only: harmonics_t
   use razy_scenes_planar_bodies, only: bodies_t
   use razy_scenes_planar_links, only: find_points, find_row, link_t
   implicit none(type, external)
   private

   public :: read_meshes

contains

   !> All meshes, as the first contacts of a machine.
   subroutine read_meshes(contact, bodies, input, harmonics, error)
      type(contact_t), intent(inout) :: contact(:)
      type(bodies_t), intent(in) :: bodies
      type(input_t), intent(in) :: input
      type(harmonics_t), intent(inout) :: harmonics
      type(error_t), allocatable, intent(out) :: error

      type(link_t) :: mesh(input%count("gear_mesh"))
      real(qp) :: ratio(bodies%count)
      integer :: i

      do i = 1, size(mesh)
         call find_mesh(mesh(i), bodies, input, i, error)
         if (allocated(error)) return
      end do
      call find_speeds(ratio, mesh, bodies, input, error)
      do i = 1, size(mesh)
         if (allocated(error)) return
         associate (row => 3*bodies%count + i)
            call read_gear_mesh(contact(i), input, i, mesh(i)%w, ratio(mesh(i)%first%body), "a body that meshes", harmonics, &
                                [row, row + size(contact)], error)
         end associate
      end do
   end subroutine read_meshes

   !> Mesh i as a link at the pitch point along the line of action.
   subroutine find_mesh(mesh, bodies, input, i, error)
      type(link_t), intent(inout) :: mesh
      type(bodies_t), intent(in) :: bodies
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      type(error_t), allocatable, intent(out) :: error

      real(wp), allocatable :: radius(:)
      real(wp) :: apart, base, e(2), way

      call find_points(mesh, bodies, input, "gear_mesh", i, 1, error)
      if (allocated(error)) return
      call input%get("gear_mesh", i, "radius", radius)
      way = merge(1.0_wp, -1.0_wp, input%choice("gear_mesh", i, "kind") == "external")
      base = radius(1) + way*radius(2)
      e = mesh%second%place - mesh%first%place
      apart = norm2(e)
      if (min(mesh%first%body, mesh%second%body) == 0) then
         call input%complain(error, "gear_mesh", i, "between", "two bodies; a ring that stands is a body on springs")
      else if (.not. abs(base) > 0.0_wp) then
         call input%complain(error, "gear_mesh", i, "radius", "two different base radii where kind = 'internal'")
      else if (.not. apart > abs(base)) then
         call input%complain(error, "gear_mesh", i, "radius", "base radii whose "// &
                             trim(merge("sum       ", "difference", way > 0.0_wp))//" is less than the distance of the "// &
                             "centres, "//decimal(1000*apart, 6)//" mm: over it, it is the cosine of the pressure angle")
      end if
      if (allocated(error)) return
      e = e/apart
      mesh%direction = merge(1.0_wp, -1.0_wp, input%choice("gear_mesh", i, "drive") == "positive")*base/apart*[-e(2), e(1)] &
                       + way*sqrt((apart - base)*(apart + base))/apart*e
      mesh%first%arm = mesh%first%arm + apart*radius(1)/base*e
      mesh%second%arm = mesh%second%arm - apart*way*radius(2)/base*e
      call find_row(mesh, bodies)
   end subroutine find_mesh

   !> Mean speeds of all bodies over that of `&rotation`; 0 where nothing says what it is.
   subroutine find_speeds(ratio, mesh, bodies, input, error)
      real(qp), intent(out) :: ratio(:)
      type(link_t), intent(in) :: mesh(:)
      type(bodies_t), intent(in) :: bodies
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      real(qp), parameter :: rounding = 1.0e-20_qp
      character(:), allocatable :: name
      integer :: ends(2, size(mesh)), i, of, way(size(mesh))

      ratio = 0.0_qp
      if (input%count("rotation") == 0) return
      call input%get("rotation", 1, "of", name)
      of = position_of(name, bodies%name)
      if (of == 0) then
         call input%complain(error, "rotation", 1, "of", "no body is named "//excerpt(name)//"; "// &
                             did_you_mean(name, bodies%name, "bodies"))
         return
      end if
      ratio(of) = 1.0_qp
      do i = 1, size(mesh)
         ends(:, i) = [mesh(i)%first%body, mesh(i)%second%body]
         way(i) = merge(-1, 1, input%choice("gear_mesh", i, "kind") == "external")
      end do
      call join_meshes(ratio, ends, way, rounding, input, error)
   end subroutine find_speeds

end module razy_scenes_planar_meshes
