!! The contacts of a lumped scene: gear meshes, stops and friction elements (source thesis, chapters 2 to 4).
!!
!! A gear mesh between wheels 1 and 2 has d = r1 q1 - r2 q2 + Δ(t) and acts with -r1 F(d) and +r2 F(d); a stop has
!! s = q1 - q2 - z(t), z a given motion of its second end, and a friction element slides with s' = q1' - q2' - belt speed; both act
!! with -F and +F.
module razy_scenes_lumped_contacts
   use razy_core_error, only: error_t
   use razy_core_kinds, only: pi, qp, wp
   use razy_core_text, only: lower
   use razy_input_input, only: input_t
   use razy_machine_machine, only: contact_t
   use razy_scenes_friction, only: read_friction
   use razy_scenes_gap_laws, only: read_gap_law
   use razy_scenes_gears, only: read_gear_mesh
   use razy_scenes_harmonics, only: add_harmonic, harmonics_t, read_frequency
   use razy_scenes_lumped_bodies, only: bodies_t, find_ends, find_row
   implicit none(type, external)
   private

   public :: new_friction, new_mesh, new_stop

contains

   !> Gear mesh i; its error goes to row `row` of the harmonics. `ratio` (bodies) are mean speeds over that of `&rotation`.
   subroutine new_mesh(contact, bodies, input, i, ratio, harmonics, row, error)
      type(contact_t), intent(out) :: contact
      type(bodies_t), intent(in) :: bodies
      type(input_t), intent(in) :: input
      integer, intent(in) :: i, row
      real(qp), intent(in) :: ratio(:)
      type(harmonics_t), intent(inout) :: harmonics
      type(error_t), allocatable, intent(out) :: error

      real(wp), allocatable :: radius(:)
      real(wp) :: w(bodies%count)
      integer :: ends(2)

      call find_ends(bodies, input, "gear_mesh", i, ends, error)
      if (allocated(error)) return
      if (any(ends == 0)) then
         call input%complain(error, "gear_mesh", i, "between", "two inertias, not the frame")
      else if (.not. all(bodies%turns(ends))) then
         call input%complain(error, "gear_mesh", i, "between", "two inertias, not masses")
      end if
      if (allocated(error)) return
      call input%get("gear_mesh", i, "radius", radius)
      w = 0.0_wp
      w(ends) = [radius(1), -radius(2)]
      call read_gear_mesh(contact, input, i, w, ratio(ends(1)), "a body that springs and meshes", harmonics, row, error)
   end subroutine new_mesh

   !> Stop i; the motion of its second end goes to row `row` of the harmonics.
   subroutine new_stop(contact, bodies, input, i, harmonics, row, error)
      type(contact_t), intent(out) :: contact
      type(bodies_t), intent(in) :: bodies
      type(input_t), intent(in) :: input
      integer, intent(in) :: i, row
      type(harmonics_t), intent(inout) :: harmonics
      type(error_t), allocatable, intent(out) :: error

      character(:), allocatable :: side
      real(wp) :: amplitude, clearance, phase
      real(qp) :: hertz

      call begin_contact(contact, bodies, input, "stop", i, error)
      if (allocated(error)) return
      call input%get("stop", i, "side", side)
      call input%get("stop", i, "clearance", clearance)
      side = lower(side)
      if (side == "both" .and. clearance < 0.0_wp) then
         call input%complain(error, "stop", i, "clearance", "at least 0 for a stop with side = 'both'")
         return
      end if
      if (side == "lower") contact%force_sign = -1.0_wp
      call read_gap_law(contact%law, input, "stop", i, [side /= "upper", side /= "lower"], [-clearance, clearance], &
                        contact%unit == "rad", error)
      if (allocated(error)) return
      call input%get("stop", i, "motion_amplitude", amplitude)
      call input%get("stop", i, "motion_phase", phase)
      call read_frequency(hertz, input, "stop", i, "motion_", abs(amplitude) > 0.0_wp, error)
      if (allocated(error)) return
      phase = phase*pi/180
      call add_harmonic(harmonics, row, hertz, -amplitude*sin(phase), -amplitude*cos(phase))
   end subroutine new_stop

   !> Friction element i; `stops` are the contacts from number `first` of the machine on that may give its normal force.
   subroutine new_friction(contact, stops, first, bodies, input, i, error)
      type(contact_t), intent(out) :: contact
      type(contact_t), intent(in) :: stops(:)
      integer, intent(in) :: first
      type(bodies_t), intent(in) :: bodies
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      type(error_t), allocatable, intent(out) :: error

      call begin_contact(contact, bodies, input, "friction", i, error)
      if (.not. allocated(error)) call read_friction(contact, stops, first, input, i, error)
   end subroutine new_friction

   !> What stops and friction elements have in common: name, direction, units.
   subroutine begin_contact(contact, bodies, input, group, i, error)
      type(contact_t), intent(inout) :: contact
      type(bodies_t), intent(in) :: bodies
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group
      integer, intent(in) :: i
      type(error_t), allocatable, intent(out) :: error

      logical :: turns

      call find_row(bodies, input, group, i, contact%w, turns, error)
      if (allocated(error)) return
      call input%get(group, i, "name", contact%name)
      contact%unit = trim(merge("rad", "m  ", turns))
      contact%force_unit = trim(merge("N m", "N  ", turns))
   end subroutine begin_contact

end module razy_scenes_lumped_contacts
