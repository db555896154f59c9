!! Where a motion starts.
module razy_scenes_start
   use razy_contact_gap_law, only: branch_open
   use razy_core_error, only: error_t
   use razy_core_kinds, only: wp
   use razy_input_input, only: input_t
   use razy_input_schema, only: add_group, add_real, add_string, group_spec_t
   use razy_machine_equilibrium, only: find_equilibrium
   use razy_machine_machine, only: machine_t, stretch_of
   use razy_scenes_scene, only: coordinate_t, scene_t
   implicit none(type, external)
   private

   public :: check_start, add_initial_group, set_start

contains

   !> Displacement and velocity at the time 0; both are 0 before.
   subroutine set_start(machine, scene, input, error)
      type(machine_t), intent(inout) :: machine
      class(scene_t), intent(in) :: scene
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      character(:), allocatable :: left, start
      character(16) :: number
      real(wp) :: at_rest(size(machine%load)), rest
      logical :: found
      integer :: at, j

      start = input%choice("motion", 1, "start")
      if (input%count("initial") > 0 .and. start /= "given") then
         call input%complain(error, "motion", 1, "start", "'given' where the file has &initial")
         return
      end if
      select case (start)
      case ("static")
         do j = 1, size(machine%contact)
            if (.not. any(machine%contact(j)%law%branch%constraint) .or. pressed_by(machine, j) > 0) cycle
            call complain_of(j)
            return
         end do
         call find_equilibrium(machine, at_rest, found, at, rest)
         machine%displacement = at_rest
         if (.not. found) then
            write (number, "(es10.3)") rest
            left = ""
            if (abs(rest) > 0.0_wp) left = ", "//trim(adjustl(number))//" N or N m are left at '"//trim(machine%coordinate(at))//"'"
            call input%complain(error, "motion", 1, "start", "the constant loads are in no equilibrium"//left// &
                                ": balance them, or start from 'zero' or 'given'")
         end if
         do j = 1, size(machine%contact)
            at = pressed_by(machine, j)
            if (allocated(error) .or. at == 0) cycle
            call stretch_of(machine%contact(at), machine%displacement, rest)
            if (machine%contact(at)%law%branch(machine%contact(at)%law%initial_branch(rest, 0.0_wp))%closed) call complain_of(j)
         end do
      case ("zero")
      case default
         call read_initial(machine, scene, input, error)
      end select
      if (.not. allocated(error)) call check_start(machine, input, error)

   contains

      subroutine complain_of(j)
         integer, intent(in) :: j

         call input%complain(error, "motion", 1, "start", "'zero', or 'given' with &initial: '"//machine%contact(j)%name// &
                             "' is a rigid stop or dry friction, with which an equilibrium is not one position")
      end subroutine complain_of

   end subroutine set_start

   !> The contact that alone presses friction element j, which is none while that is open; 0: contact j is no such element.
   pure integer function pressed_by(machine, j) result(by)
      type(machine_t), intent(in) :: machine
      integer, intent(in) :: j

      by = 0
      if (machine%contact(j)%normal_of == 0 .or. machine%contact(j)%normal > 0.0_wp) return
      if (any(machine%contact(machine%contact(j)%normal_of)%law%branch%constraint)) return
      by = machine%contact(j)%normal_of
   end function pressed_by

   !> Add the group &initial.
   subroutine add_initial_group(schema)
      type(group_spec_t), allocatable, intent(inout) :: schema(:)

      call add_group(schema, "initial", "State of a coordinate at the start, for start='given'; the others start with zero", &
                     repeatable=.true.)
      call add_string(schema, "on", "name of a mass or inertia, or of a coordinate such as 'table.y'; of shafts, without "// &
                      "&reduction only, such as 'input.8.phi'", required=.true.)
      call add_real(schema, "displacement", "displacement from the reference position", unit="m or rad", default="0.0")
      call add_real(schema, "velocity", "velocity", unit="m/s or rad/s", default="0.0")
   end subroutine add_initial_group

   !> What the groups &initial say; both are zero before.
   subroutine read_initial(machine, scene, input, error)
      type(machine_t), intent(inout) :: machine
      class(scene_t), intent(in) :: scene
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      type(coordinate_t) :: on
      integer :: i

      do i = 1, input%count("initial")
         call scene%find_coordinate(on, input, "initial", i, "on", error)
         if (allocated(error)) return
         call input%get("initial", i, "displacement", machine%displacement(on%number))
         call input%get("initial", i, "velocity", machine%velocity(on%number))
      end do
   end subroutine read_initial

   !> A motion cannot start beyond a rigid stop.
   subroutine check_start(machine, input, error)
      type(machine_t), intent(in) :: machine
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      real(wp) :: rounding, s
      integer :: j

      do j = 1, size(machine%contact)
         associate (contact => machine%contact(j), edge => machine%contact(j)%law%branch(branch_open)%guard(1))
            if (.not. contact%law%impacts) cycle
            s = dot_product(contact%w, machine%displacement) + contact%offset + sum(real(contact%error))
            rounding = 16*epsilon(1.0_wp)*(dot_product(abs(contact%w), abs(machine%displacement)) + abs(contact%offset) &
                                           + sum(abs(contact%error)))
            if (.not. ((edge%above /= 0 .and. s > edge%upper + rounding) &
                       .or. (edge%below /= 0 .and. s < edge%lower - rounding))) cycle
            call input%complain(error, "motion", 1, "start", "a state that is not beyond the rigid stop '"//contact%name// &
                                "'; give the position by start = 'given' and &initial")
            return
         end associate
      end do
   end subroutine check_start

end module razy_scenes_start
