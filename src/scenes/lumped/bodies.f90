!! The bodies of a lumped scene, and what refers to them by name.
module razy_scenes_lumped_bodies
   use razy_core_error, only: error_t
   use razy_input_input, only: input_t
   use razy_core_kinds, only: wp
   use razy_core_text, only: did_you_mean, lower, string_t
   implicit none(type, external)
   private

   public :: bodies_t, find_body, find_ends, new_bodies

   !> Bodies, each with one coordinate: first the inertias, then the masses, in the order of the input.
   type :: bodies_t
      integer :: count = 0
      type(string_t), allocatable :: name(:)
      !> kg or kg m².
      real(wp), allocatable :: mass(:)
      logical, allocatable :: turns(:)
   contains
      procedure :: unit
   end type bodies_t

contains

   !> All bodies of the input; there has to be one.
   subroutine new_bodies(self, input, error)
      type(bodies_t), intent(out) :: self
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      character(:), allocatable :: name
      integer :: i, inertias, masses

      inertias = input%count("inertia")
      masses = input%count("mass")
      self%count = inertias + masses
      if (self%count == 0) then
         call input%complain(error, "scene", 1, "kind", "a lumped scene needs at least one &inertia or &mass")
         return
      end if
      allocate (self%name(self%count), self%mass(self%count), self%turns(self%count))
      do i = 1, self%count
         self%turns(i) = i <= inertias
         if (self%turns(i)) then
            call input%get("inertia", i, "name", name)
            call input%get("inertia", i, "value", self%mass(i))
         else
            call input%get("mass", i - inertias, "name", name)
            call input%get("mass", i - inertias, "value", self%mass(i))
         end if
         self%name(i)%text = name
         if (lower(name) == "frame") then
            call input%complain(error, merge("inertia", "mass   ", self%turns(i)), merge(i, i - inertias, self%turns(i)), "name", &
                                "any name but frame, which is what does not move")
            return
         end if
      end do
   end subroutine new_bodies

   !> The unit of a quantity of body `i`, given for translation and rotation.
   pure function unit(self, i, translation, rotation)
      class(bodies_t), intent(in) :: self
      integer, intent(in) :: i
      character(*), intent(in) :: translation, rotation
      character(:), allocatable :: unit

      if (self%turns(i)) then
         unit = rotation
      else
         unit = translation
      end if
   end function unit

   !> The number of the body that `group(index)%key` names in its element `element`.
   subroutine find_body(self, input, group, index, key, element, body, error)
      type(bodies_t), intent(in) :: self
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group, key
      integer, intent(in) :: index, element
      integer, intent(out) :: body
      type(error_t), allocatable, intent(out) :: error

      type(string_t), allocatable :: names(:)

      call input%get(group, index, key, names)
      body = number_of(self, names(element)%text)
      if (body == 0) call input%complain(error, group, index, key, "no body is named "//names(element)%text//"; " &
                                         //did_you_mean(names(element)%text, self%name, "bodies"))
   end subroutine find_body

   !> The two bodies that `group(index)%between` names; 0 is the frame. They have to move alike.
   subroutine find_ends(self, input, group, index, ends, error)
      type(bodies_t), intent(in) :: self
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group
      integer, intent(in) :: index
      integer, intent(out) :: ends(2)
      type(error_t), allocatable, intent(out) :: error

      type(string_t), allocatable :: names(:)
      integer :: i

      ends = 0
      call input%get(group, index, "between", names)
      do i = 1, 2
         if (lower(names(i)%text) == "frame") cycle
         ends(i) = number_of(self, names(i)%text)
         if (ends(i) == 0) then
            call input%complain(error, group, index, "between", "no body is named "//names(i)%text//"; " &
                                //did_you_mean(names(i)%text, [self%name, string_t("frame")], "bodies"))
            return
         end if
      end do
      if (ends(1) == ends(2)) then
         call input%complain(error, group, index, "between", "two different bodies, or a body and 'frame'")
      else if (all(ends > 0)) then
         if (self%turns(ends(1)) .neqv. self%turns(ends(2))) then
            call input%complain(error, group, index, "between", "two inertias or two masses, not one of each")
         end if
      end if
   end subroutine find_ends

   pure function number_of(self, name) result(body)
      type(bodies_t), intent(in) :: self
      character(*), intent(in) :: name
      integer :: body

      do body = 1, self%count
         if (lower(self%name(body)%text) == lower(name)) return
      end do
      body = 0
   end function number_of

end module razy_scenes_lumped_bodies
