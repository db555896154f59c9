!! Stops and friction elements of any scene, which says where they act.
module razy_scenes_contacts
   use razy_core_error, only: error_t
   use razy_core_kinds, only: pi, qp, wp
   use razy_input_input, only: input_t
   use razy_machine_machine, only: contact_t, machine_t
   use razy_scenes_friction, only: read_friction
   use razy_scenes_gap_laws, only: read_gap_law
   use razy_scenes_harmonics, only: add_harmonic, harmonics_t, read_frequency
   use razy_scenes_scene, only: scene_t, site_t
   implicit none(type, external)
   private

   public :: read_contacts

contains

   !> Stops, then friction elements, which follow the `meshes` gear meshes of the machine.
   subroutine read_contacts(machine, scene, meshes, input, harmonics, error)
      type(machine_t), intent(inout) :: machine
      class(scene_t), intent(in) :: scene
      integer, intent(in) :: meshes
      type(input_t), intent(in) :: input
      type(harmonics_t), intent(inout) :: harmonics
      type(error_t), allocatable, intent(out) :: error

      type(site_t) :: site
      integer :: i, stop, stops

      stops = input%count("stop")
      do i = 1, stops + input%count("friction")
         associate (contact => machine%contact(meshes + i))
            if (i <= stops) then
               call scene%find_site(site, input, "stop", i, 0, error)
               if (allocated(error)) return
               call read_stop(contact, site, input, i, harmonics, size(machine%load) + meshes + i, error)
               if (.not. allocated(error)) call input%get("stop", i, "name", contact%name)
            else
               call read_friction(contact, machine%contact(meshes + 1:meshes + stops), input, i - stops, stop, error)
               if (allocated(error)) return
               if (contact%normal_of > 0) contact%normal_of = contact%normal_of + meshes
               if (contact%only_with > 0) contact%only_with = contact%only_with + meshes
               call scene%find_site(site, input, "friction", i - stops, stop, error)
               if (.not. allocated(error)) contact%drive = contact%drive + site%drive
               if (.not. allocated(error)) call input%get("friction", i - stops, "name", contact%name)
            end if
            if (allocated(error)) return
            contact%w = site%w
            contact%unit = trim(merge("rad", "m  ", site%turns))
            contact%force_unit = trim(merge("N m", "N  ", site%turns))
         end associate
      end do
   end subroutine read_contacts

   !> Stop i; the motion of its second end goes to row `row` of the harmonics.
   subroutine read_stop(contact, site, input, i, harmonics, row, error)
      type(contact_t), intent(inout) :: contact
      type(site_t), intent(in) :: site
      type(input_t), intent(in) :: input
      integer, intent(in) :: i, row
      type(harmonics_t), intent(inout) :: harmonics
      type(error_t), allocatable, intent(out) :: error

      real(wp) :: amplitude, clearance, factor, phase
      real(qp) :: hertz

      call input%get("stop", i, "clearance", clearance)
      if (all(site%sides) .and. clearance < 0.0_wp) then
         call input%complain(error, "stop", i, "clearance", "at least 0 for a stop with side = 'both'")
         return
      end if
      if (.not. site%sides(2)) contact%force_sign = -1.0_wp
      ! Keys that some kinds of scene do not have.
      factor = 0.0_wp
      amplitude = 0.0_wp
      phase = 0.0_wp
      if (input%given("stop", i, "damping_factor")) call input%get("stop", i, "damping_factor", factor)
      if (input%given("stop", i, "motion_amplitude")) call input%get("stop", i, "motion_amplitude", amplitude)
      if (input%given("stop", i, "motion_phase")) call input%get("stop", i, "motion_phase", phase)
      call read_gap_law(contact%law, input, "stop", i, site%sides, [-clearance, clearance], site%turns, factor, error)
      if (.not. allocated(error)) call read_frequency(hertz, input, "stop", i, "motion_", abs(amplitude) > 0.0_wp, error)
      if (allocated(error)) return
      phase = phase*pi/180
      call add_harmonic(harmonics, row, hertz, -amplitude*sin(phase), -amplitude*cos(phase))
   end subroutine read_stop

end module razy_scenes_contacts
